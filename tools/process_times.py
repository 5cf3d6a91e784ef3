"""CPU time (user and system) of whole processes.

Builds run in turn, so that machine load affects all alike.

    python3 tools/process_times.py BEFORE target/release/flexarm -- compare reference_arm --no-files --step 0.008

Prints the minimum time, the lower quartile and the median of each program in ms, and its page
faults.
"""

import argparse
import os
import sys


def run(program, arguments):
    """Returns milliseconds and page faults of one process; its output is dropped."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    quiet = [(os.POSIX_SPAWN_DUP2, nowhere, stream) for stream in (1, 2)]
    pid = os.posix_spawn(program, [program, *arguments], os.environ, file_actions=quiet)
    _, status, used = os.wait4(pid, 0)
    os.close(nowhere)
    if status != 0:
        sys.exit(f"{program} ended with {os.waitstatus_to_exitcode(status)}")
    return (used.ru_utime + used.ru_stime) * 1e3, used.ru_minflt


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="+", help="paths of builds")
    parser.add_argument("--times", type=int, default=60, help="runs of each")
    arguments = sys.argv[1:]
    split = arguments.index("--") if "--" in arguments else len(arguments)
    options = parser.parse_args(arguments[:split])
    runs = {program: [] for program in options.programs}
    for _ in range(options.times):
        for program in options.programs:
            runs[program].append(run(program, arguments[split + 1 :]))
    for program, seen in runs.items():
        times = sorted(time for time, _ in seen)
        smallest, quartile, median = (times[len(times) * part // 4] for part in range(3))
        print(f"{program}: {smallest:.2f} {quartile:.2f} {median:.2f} ms, {min(faults for _, faults in seen)} page faults")


if __name__ == "__main__":
    main()
