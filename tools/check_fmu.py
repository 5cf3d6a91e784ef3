#!/usr/bin/env python3
"""Checks FMUs of shipped robots with FMPy, an importer from outside.

    python3 -m venv venv && venv/bin/pip install fmpy
    cargo build --release && venv/bin/python tools/check_fmu.py

Every FMU is validated (schema, references, structure) and simulated along a swing of its joints, also
in model exchange by CVode. Then with the functions of the standard: the same bits twice, after a reset
and after a return to a state; two instances side by side; wrong calls get the status error; 1,000
instances are made and freed without growth of memory; the real-time factor at 1 kHz. Without FMPy it
says 'skipped'.
"""
import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CASES = [  # robot, options
    ("kr210", []),
    ("robots/test/reference_arm", ["--drives", "servo", "--links", "modal"]),
    ("tests/golden/ur10_like.urdf", []),
    ("kr210", ["--links", "modal"]),
    ("kr300", ["--drives", "servo"]),
    ("palletiser", []),
    ("manutec_r3", []),
]
PERIOD = 1e-3


class Importer:
    """An unpacked FMU with the functions of its version under one name."""

    def __init__(self, path, folder):
        import fmpy

        self.fmpy = fmpy
        self.folder = fmpy.extract(str(path), str(folder))
        self.description = fmpy.read_model_description(self.folder)
        self.is_3 = self.description.fmiVersion.startswith("3")
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        targets = [v for v in self.description.modelVariables if v.name.endswith(".target_position")]
        self.targets = [v.valueReference for v in targets]
        self.pose = [float(v.start) for v in targets]
        tcp = [f"tcp.position.{axis}" for axis in "xyz"] + [f"tcp_error.position.{axis}" for axis in "xyz"]
        self.outputs = [self.references[name] for name in tcp]

    def instance(self, logger=None):
        """Returns a new instance."""
        return self.fmpy.instantiate_fmu(self.folder, self.description, "CoSimulation", logger=logger)

    def exchange(self):
        """Simulates with a solver of the importer and with that of the FMU, joints under servos with
        nine tenths of the torques that hold them; returns the largest difference of the TCP error, the
        largest error (m), and the number of states."""
        import numpy as np

        # The importer holds inputs from one output to the next: the difference is proportional to it.
        period = 1e-4
        t = np.linspace(0.0, 0.2, round(0.2 / period) + 1)
        motion = {"position": 0.05 * (20.0 * t - np.sin(20.0 * t)), "velocity": 1.0 - np.cos(20.0 * t),
                  "acceleration": 20.0 * np.sin(20.0 * t)}
        joints = [v.name.rsplit(".", 1)[0] for v in self.description.modelVariables if v.name.endswith("target_position")]
        names = {what: [f"{joint}.target_{what}" for joint in joints] for what in motion}

        instance = self.instance()
        put, get = (instance.setFloat64, instance.getFloat64) if self.is_3 else (instance.setReal, instance.getReal)
        flags = [self.references[name] for name in ("use_target_velocity", "open_servos") if name in self.references]
        instance.setBoolean(flags, [True] * len(flags))
        self.start(instance)
        motors = [joint for joint in joints if f"{joint}.torque" in self.references]
        torques = {f"{joint}.torque": 0.9 * get([self.references[f"{joint}.effort"]])[0] for joint in motors}
        put([self.references[name] for name in torques], list(torques.values()))
        own = [self.get(instance)[3:]]
        for k in range(1, len(t)):
            put(self.targets, [q + motion["position"][k] for q in self.pose])
            put([self.references[name] for name in names["velocity"]], [motion["velocity"][k]] * len(joints))
            self.step(instance, k - 1, period)
            own.append(self.get(instance)[3:])
        instance.terminate()
        instance.freeInstance()

        inputs = [v for v in self.description.modelVariables if v.causality == "input"]
        columns = {"time": t} | {v.name: np.full(len(t), torques.get(v.name, v.start == "true")) for v in inputs}
        for what, values in motion.items():
            start = self.pose if what == "position" else [0.0] * len(joints)
            columns.update((name, begin + values) for name, begin in zip(names[what], start))
        kinds = {v.name: bool for v in inputs if v.type == "Boolean"}
        given = np.array(list(zip(*columns.values())), dtype=[(name, kinds.get(name, float)) for name in columns])
        outputs = ["tcp_error.position." + axis for axis in "xyz"]
        run = self.fmpy.simulate_fmu(self.folder, fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-8,
                                     stop_time=0.2, output_interval=period, input=given, output=outputs)
        own, other = np.array(own), np.array([run[name] for name in outputs]).T
        states = sum(v.derivative is not None for v in self.description.modelVariables)
        return np.abs(own - other[:len(own)]).max(), np.abs(own).max(), states

    def start(self, instance):
        """Initialises an instance at time 0."""
        if self.is_3:
            instance.enterInitializationMode(startTime=0.0)
        else:
            instance.setupExperiment(startTime=0.0)
            instance.enterInitializationMode()
        instance.exitInitializationMode()

    def get(self, instance):
        """Returns the outputs."""
        return (instance.getFloat64 if self.is_3 else instance.getReal)(self.outputs)

    def set(self, instance, values):
        """Sets the target positions."""
        (instance.setFloat64 if self.is_3 else instance.setReal)(self.targets, values)

    def step(self, instance, k, period=PERIOD):
        """Simulates the step after k steps."""
        instance.doStep(currentCommunicationPoint=k * period, communicationStepSize=period)

    def swing(self, instance, first, last):
        """Swings all joints; returns the outputs at the end."""
        import math

        for k in range(first, last):
            s = 4.0 * (k + 1) * PERIOD
            self.set(instance, [q + 0.05 * (1 - math.cos(s)) * (1 + 0.1 * j) for j, q in enumerate(self.pose)])
            self.step(instance, k)
        return self.get(instance)

    def state(self, instance):
        """Returns a copy of the state."""
        return instance.getFMUState() if self.is_3 else instance.getFMUstate()

    def restore(self, instance, state):
        """Returns to a state."""
        (instance.setFMUState if self.is_3 else instance.setFMUstate)(state)


class Report:
    """Prints one line per check and counts those that fail."""

    failures = 0

    def say(self, name, ok, what=""):
        self.failures += not ok
        print(f"  {'ok   ' if ok else 'FAILS'} {name}{': ' if what else ''}{what}", flush=True)


def refused(work):
    """Returns whether a call gets the status error."""
    try:
        work()
    except Exception:  # FMPy raises its own for a status above warning
        return True
    return False


def check(path, report, rounds):
    """Checks one FMU."""
    from fmpy.validation import validate_fmu

    problems = validate_fmu(str(path))
    report.say("validate_fmu", not problems, "; ".join(problems)[:300])
    folder = Path(tempfile.mkdtemp(prefix="fmu with blanks "))
    try:
        fmu = Importer(path, folder)
        a, b = fmu.instance(), fmu.instance()
        fmu.start(a)
        fmu.start(b)
        begin = time.perf_counter()
        end = fmu.swing(a, 0, 1000)
        factor = 1.0 / (time.perf_counter() - begin)
        report.say("two instances side by side", fmu.swing(b, 0, 1000) == end, f"{factor:.0f} times real time at 1 kHz")
        b.terminate()
        b.reset()
        fmu.start(b)
        report.say("the same bits after a reset", fmu.swing(b, 0, 1000) == end)
        state = fmu.state(a)
        later = fmu.swing(a, 1000, 1300)
        fmu.restore(a, state)
        first = fmu.swing(a, 1000, 1300)
        fmu.restore(a, state)
        report.say("the same bits after returns to a state", first == later == fmu.swing(a, 1000, 1300))
        if fmu.description.modelExchange:
            apart, largest, states = fmu.exchange()
            report.say("model exchange with CVode is co-simulation", apart < 5e-3 * largest,
                       f"{states} states, {apart:.1e} of {largest:.1e} m apart")
        finite = fmu.get(a)
        wrong = [lambda: fmu.set(a, [float("nan")] * len(fmu.targets)), lambda: fmu.step(a, 5),
                 lambda: fmu.start(a), lambda: (a.getFloat64 if fmu.is_3 else a.getReal)([99999])]
        report.say("wrong calls get an error", all(refused(call) for call in wrong))
        report.say("and change nothing", fmu.get(a) == finite)
        a.terminate()
        for instance in (a, b):
            instance.freeInstance()
        growth = []
        for k in range(rounds):
            instance = fmu.instance()
            fmu.start(instance)
            fmu.step(instance, 0)
            instance.terminate()
            instance.freeInstance()
            if k in (rounds // 5, rounds - 1):
                growth.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
        report.say(f"{rounds} instances made and freed", growth[-1] - growth[0] < 5.0,
                   f"memory grows by {growth[-1] - growth[0]:.1f} MB")
        threads = len(os.listdir("/proc/self/task")) if os.path.isdir("/proc/self/task") else 1
        report.say("no thread is left", threads == 1, f"{threads} in all")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--rounds", type=int, default=1000, help="instances made and freed, once for each version")
    parser.add_argument("--cases", type=int, default=len(CASES), help="number of robots")
    options = parser.parse_args()
    rounds, cases = options.rounds, CASES[:options.cases]
    try:
        import fmpy  # noqa: F401
    except ImportError:
        print("skipped: there is no fmpy (pip install fmpy)")
        return 0
    # numpy's threads are not those of the FMU
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    report = Report()
    with tempfile.TemporaryDirectory() as folder:
        for version in ("3.0", "2.0"):
            for number, (robot, choices) in enumerate(cases):
                path = Path(folder) / f"arm_{number}_{version[0]}.fmu"
                command = [ROOT / "target/release/flexarm", "export-fmu", robot, "--fmi", version, "-o", path, *choices]
                done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
                print(f"{robot} {' '.join(choices)} FMI {version}: {path.stat().st_size / 1e6 if path.exists() else 0:.1f} MB")
                if done.returncode != 0:
                    report.say("export-fmu", False, done.stderr[-500:])
                    continue
                check(path, report, rounds if number == 0 else 20)
    print("all hold" if report.failures == 0 else f"{report.failures} fail")
    return int(report.failures > 0)


if __name__ == "__main__":
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    sys.exit(main())
