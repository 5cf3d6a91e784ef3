// Tests of the arm under commands, without ROS. They need shipped robots:
//
//     ./test_commanded_arm ../../robots
//
// Each test is a sentence about the arm; a failed one prints its numbers.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "flexarm_ros2_control/commanded_arm.hpp"
#include "flexarm_ros2_control/settings.hpp"

namespace
{

using flexarm_ros2_control::ArmError;
using flexarm_ros2_control::CommandedArm;
using flexarm_ros2_control::CommandMode;
using flexarm_ros2_control::JointCommand;
using flexarm_ros2_control::Settings;
using flexarm_ros2_control::settings_of;

using Given = std::unordered_map<std::string, std::string>;

constexpr double pi = 3.141592653589793;
constexpr double period_s = 1e-3;

std::string robots;
int failures = 0;

/// Prints a measured number beside its bound.
void below(const std::string & what, double found, double bound)
{
  const bool holds = found < bound;
  std::printf("  %s %s: %.3e, bound %.1e\n", holds ? "ok  " : "FAIL", what.c_str(), found, bound);
  failures += !holds;
}

void holds(const std::string & what, bool condition)
{
  std::printf("  %s %s\n", condition ? "ok  " : "FAIL", what.c_str());
  failures += !condition;
}

/// Expects an error whose message has all these words.
void refused(
  const std::string & what, const std::vector<std::string> & words,
  const std::function<void()> & work)
{
  try {
    work();
  } catch (const ArmError & error) {
    bool all = true;
    for (const auto & word : words) {
      all = all && std::string(error.what()).find(word) != std::string::npos;
    }
    holds(what + ": " + error.what(), all);
    return;
  }
  holds(what + ": there was no error", false);
}

Settings settings(Given given, const std::string & robot = "kr210", double period = period_s)
{
  given.emplace("robot", robots + "/" + robot);
  return settings_of(given, period);
}

Settings with_open_servos()
{
  return settings({{"drives", "servo"}, {"command_mode", "effort"}}, "kr300");
}

/// Names of six joints.
std::vector<std::string> six(const std::string & name = "joint_")
{
  std::vector<std::string> joints;
  for (int k = 1; k <= 6; ++k) {
    joints.push_back(name + std::to_string(k));
  }
  return joints;
}

/// Commands to six joints of which only the first has one.
std::vector<JointCommand> first(const JointCommand & command)
{
  std::vector<JointCommand> commands(6);
  commands[0] = command;
  return commands;
}

/// A smooth move of joint 1 by 0.1 rad in 0.5 s: position and velocity at a time.
JointCommand ramp(double t)
{
  const double s = std::min(t / 0.5, 1.0);
  JointCommand command;
  command.position = 0.05 * (1.0 - std::cos(pi * s));
  command.velocity = s < 1.0 ? 0.1 * pi * std::sin(pi * s) : 0.0;
  return command;
}

/// The same 1 s with flexarm.h alone, as examples/ramp.c has it: TCP error at the end of each step.
std::vector<double> ramp_of_c_interface()
{
  flexarm_plant * plant =
    flexarm_open((robots + "/kr210").c_str(), nullptr, nullptr, 0.0, nullptr, 0);
  const auto target = static_cast<std::uint32_t>(
    flexarm_find(plant, "joint.joint_1.target_position"));
  const auto error = static_cast<std::uint32_t>(flexarm_find(plant, "tcp_error.length"));
  std::vector<double> errors;
  flexarm_start(plant, 0.0);
  for (int k = 1; k <= 1000; ++k) {
    const double q = ramp(k * period_s).position;
    flexarm_set(plant, &target, &q, 1);
    flexarm_step(plant, period_s);
    double length = 0.0;
    flexarm_get(plant, &error, &length, 1);
    errors.push_back(length);
  }
  flexarm_free(plant);
  return errors;
}

void the_arm_has_the_bits_of_the_c_interface()
{
  const auto truth = ramp_of_c_interface();
  CommandedArm arm(settings({}), six());
  const auto error = arm.watch("tcp_error.length");
  arm.start(std::vector<double>(6, 0.0));
  double apart = 0.0;
  double largest = 0.0;
  for (int k = 1; k <= 1000; ++k) {
    JointCommand command;
    command.position = ramp(k * period_s).position;
    arm.command(first(command));
    arm.advance(period_s);
    apart = std::max(apart, std::abs(arm.output(error) - truth[k - 1]));
    largest = std::max(largest, truth[k - 1]);
    if (k % 100 == 0) {
      std::printf("  %5.2f s  %8.4f mm\n", arm.time_s(), 1e3 * arm.output(error));
    }
  }
  std::printf("  largest %.4f mm\n", 1e3 * largest);
  holds("all 1,000 errors have the same bits", apart == 0.0);
}

void a_still_arm_sags_and_stays()
{
  CommandedArm arm(settings({}), six());
  const auto error = arm.watch("tcp_error.length");
  arm.start({0.0, -1.0, 1.2, 0.0, 0.5, 0.0});
  const double sag = arm.output(error);
  holds("it sags", sag > 1e-4);
  for (int k = 0; k < 500; ++k) {
    arm.advance(period_s);
  }
  below("change of the sag in 0.5 s (relative)", std::abs(arm.output(error) / sag - 1.0), 1e-9);
  below("motor off its pose (rad)", std::abs(arm.state(1).position + 1.0), 1e-12);
  const auto state = arm.state(1);
  holds("the link is behind the gearbox", std::abs(state.link_position - state.position) > 1e-5);
}

void the_clock_keeps_what_is_no_whole_step()
{
  // Periods of 0.3 to 1.9 solver steps, 1 s in all.
  CommandedArm arm(settings({{"step", "1e-3"}}), six());
  arm.start(std::vector<double>(6, 0.0));
  double controller_s = 0.0;
  double apart = 0.0;
  for (int k = 0; controller_s < 1.0; ++k) {
    const double length = 1e-3 * (1.1 + 0.8 * std::sin(1.7 * k));
    controller_s += length;
    arm.advance(length);
    apart = std::max(apart, std::abs(controller_s - arm.time_s()));
  }
  below("arm off the controller's time (s)", apart, 0.5e-3 + 1e-9);

  const double left_out = arm.advance(5.0);
  below("time left out of 5 s less the longest 0.1 s (s)", std::abs(left_out - 4.9), 1e-12);
}

/// A controller whose cycle comes early and late samples its motion at the times that it measures.
void uneven_periods_do_not_shake_the_arm()
{
  for (const std::string mode : {"position", "position_velocity", "velocity"}) {
    CommandedArm even(settings({{"command_mode", mode}}), six());
    CommandedArm uneven(settings({{"command_mode", mode}}), six());
    const auto error = even.watch("tcp_error.position.y");
    uneven.watch("tcp_error.position.y");
    even.start(std::vector<double>(6, 0.0));
    uneven.start(std::vector<double>(6, 0.0));
    double late_s = 0.0;
    double apart = 0.0;
    double largest = 0.0;
    for (int k = 1; k <= 1000; ++k) {
      even.advance(period_s);
      even.command(first(ramp(k * period_s)));
      // Up to 0.2 ms early and late.
      const double before_s = late_s;
      late_s = 0.2e-3 * std::sin(2.1 * k);
      uneven.advance(period_s + late_s - before_s);
      uneven.command(first(ramp(k * period_s + late_s)));
      apart = std::max(apart, std::abs(uneven.output(error) - even.output(error)));
      largest = std::max(largest, std::abs(even.output(error)));
    }
    std::printf("  largest %.4f mm, apart %.6f mm\n", 1e3 * largest, 1e3 * apart);
    below(mode + ": TCP errors apart over the largest", apart / largest, 5e-3);
  }
}

void the_step_divides_the_period()
{
  for (const double hertz : {1000.0, 600.0, 250.0, 4000.0}) {
    CommandedArm arm(settings({}, "kr210", 1.0 / hertz), six());
    const double steps = 1.0 / (hertz * arm.step_s());
    below(
      std::to_string(static_cast<int>(hertz)) + " Hz: steps in a period off a whole number",
      std::abs(steps - std::round(steps)) + (steps < 0.5 ? 1.0 : 0.0), 1e-9);
  }
}

void velocities_and_positions_with_velocities_arrive_at_the_same_place()
{
  CommandedArm by_position(settings({{"command_mode", "position_velocity"}}), six());
  CommandedArm by_velocity(settings({{"command_mode", "velocity"}}), six());
  for (auto * arm : {&by_position, &by_velocity}) {
    arm->start(std::vector<double>(6, 0.0));
  }
  for (int k = 1; k <= 600; ++k) {
    const auto command = ramp(k * period_s);
    by_position.command(first(command));
    JointCommand velocity;
    velocity.velocity = command.velocity;
    by_velocity.command(first(velocity));
    by_position.advance(period_s);
    by_velocity.advance(period_s);
  }
  below("end off 0.1 rad by position (rad)", std::abs(by_position.state(0).position - 0.1), 1e-12);
  // The velocities are integrated by the trapezoidal rule: h^2 / 12 (v'(0.5 s) - v'(0)).
  const double off = -period_s * period_s / 12.0 * 0.4 * pi * pi;
  const double found = by_velocity.state(0).position - 0.1;
  below("end off that of the trapezoidal rule (relative)", std::abs(found / off - 1.0), 1e-3);
}

void servos_follow_and_an_effort_is_added_to_theirs()
{
  CommandedArm arm(settings({{"drives", "servo"}}, "kr300"), six("joint_a"));
  arm.start(std::vector<double>(6, 0.0));
  for (int k = 1; k <= 1000; ++k) {
    auto command = ramp(k * period_s);
    command.effort = 0.0;
    arm.command(first(command));
    arm.advance(period_s);
  }
  const double still = arm.state(0).position;
  below("servo off its target after 1 s (rad)", std::abs(still - 0.1), 1e-3);
  JointCommand pushed;
  pushed.effort = 500.0;
  arm.command(first(pushed));
  for (int k = 0; k < 20; ++k) {
    arm.advance(period_s);
  }
  holds("an added torque moves it on", arm.state(0).position > still + 1e-6);
}

void open_servos_hold_until_a_torque_moves_them()
{
  CommandedArm arm(with_open_servos(), six("joint_a"));
  const auto error = arm.watch("tcp_error.length");
  arm.start({0.0, -1.0, 1.2, 0.0, 0.5, 0.0});
  const double sag = arm.output(error);
  const double holding = arm.commanded(1).effort;
  holds("joint 2 is held by a torque", std::abs(holding) > 100.0);
  for (int k = 0; k < 100; ++k) {
    arm.advance(period_s);
  }
  below("drift in 0.1 s under holding torques (rad)", std::abs(arm.state(1).position + 1.0), 1e-6);

  // A torque on the vertical axis alone turns it; the TCP error stays one of elasticity.
  JointCommand turn;
  turn.effort = 2000.0;
  arm.command(first(turn));
  for (int k = 0; k < 300; ++k) {
    arm.advance(period_s);
  }
  const auto state = arm.state(0);
  holds("joint 1 turns", state.position > 0.01 && state.velocity > 0.1);
  below("TCP error while it turns over the sag", arm.output(error) / sag, 2.0);
}

/// Joint 1 turns about the vertical, so a controller without integral part gets it to its target.
void a_controller_closes_the_loop()
{
  CommandedArm arm(with_open_servos(), six("joint_a"));
  arm.start(std::vector<double>(6, 0.0));
  std::vector<double> held;
  for (std::size_t k = 0; k < 6; ++k) {
    held.push_back(arm.commanded(k).effort);
  }
  const std::vector<double> stiffness = {4e5, 4e5, 2e5, 2e4, 2e4, 1e4};
  std::vector<JointCommand> commands(6);
  for (int i = 1; i <= 2000; ++i) {
    for (std::size_t k = 0; k < 6; ++k) {
      const auto target = k == 0 ? ramp(i * period_s) : JointCommand{0.0, 0.0, 0.0};
      const auto state = arm.state(k);
      JointCommand command;
      command.effort = held[k] + stiffness[k] * (target.position - state.position) +
        0.1 * stiffness[k] * (target.velocity - state.velocity);
      commands[k] = command;
    }
    arm.command(commands);
    arm.advance(period_s);
  }
  below("joint 1 off 0.1 rad (rad)", std::abs(arm.state(0).position - 0.1), 1e-3);
}

void forces_on_the_tcp_are_inputs()
{
  CommandedArm arm(settings({}), six());
  const auto force = arm.drive("tcp.force.z");
  const auto z = arm.watch("tcp.position.z");
  arm.start(std::vector<double>(6, 0.0));
  const double before = arm.output(z);
  arm.set_input(force, -1000.0);
  for (int k = 0; k < 2000; ++k) {
    arm.advance(period_s);
  }
  const double lower = before - arm.output(z);
  holds("1 kN presses it down by millimetres", lower > 1e-4 && lower < 2e-2);
  std::printf("  %.4f mm\n", 1e3 * lower);
}

void what_makes_no_sense_is_refused_with_a_remedy()
{
  refused("no robot", {"robot"}, [] {settings_of({}, period_s);});
  refused(
    "missing file", {"no_such_robot"}, [] {CommandedArm(settings({}, "no_such_robot"), six());});
  refused(
    "unknown mode", {"command_mode", "torque", "effort"},
    [] {settings({{"command_mode", "torque"}});});
  refused("no number", {"step", "1 ms"}, [] {settings({{"step", "1 ms"}});});
  refused(
    "comma for a point", {"step", "0,001"}, [] {settings({{"step", "0,001"}});});
  refused("period", {"max_period"}, [] {settings({{"max_period", "0"}});});
  refused(
    "unknown parameter", {"stifness_factor", "stiffness_factor", "payload.mass"},
    [] {CommandedArm(settings({{"stifness_factor", "2"}}), six());});
  refused(
    "flag of a mode", {"open_servos", "command_mode"}, [] {settings({{"open_servos", "1"}});});
  refused(
    "unknown links", {"links", "soft", "modal"},
    [] {CommandedArm(settings({{"links", "soft"}}), six());});
  refused(
    "no servos", {"effort", "servo"},
    [] {CommandedArm(settings({{"command_mode", "effort"}}), six());});
  refused(
    "unknown joint", {"joint_7", "mimic"},
    [] {auto joints = six(); joints[5] = "joint_7"; CommandedArm(settings({}), joints);});
  refused(
    "joint left out", {"6", "5"},
    [] {auto joints = six(); joints.pop_back(); CommandedArm(settings({}), joints);});
  refused(
    "no prefix", {"left_"}, [] {CommandedArm(settings({{"prefix", "left_"}}), six());});
  refused(
    "unknown output", {"tcp.speed", "tcp.velocity.x"},
    [] {CommandedArm arm(settings({}), six()); arm.watch("tcp.speed");});
  refused(
    "input of a joint", {"joint.joint_1.torque", "tcp.force.x"},
    [] {CommandedArm arm(settings({}), six()); arm.drive("joint.joint_1.torque");});
  refused(
    "infinite command", {"joint_1", "infinity"}, [] {
      CommandedArm arm(settings({}), six());
      arm.start(std::vector<double>(6, 0.0));
      JointCommand command;
      command.position = INFINITY;
      arm.command(first(command));
    });
  CommandedArm prefixed(settings({{"prefix", "left_"}}), six("left_joint_"));
  holds("a prefix is taken off", true);
  holds(
    "names are quoted as in the plant",
    flexarm_ros2_control::part("1st joint") == "'1st joint'" &&
    flexarm_ros2_control::part("a'b\\c") == "'a\\'b\\\\c'" &&
    flexarm_ros2_control::part("joint_1") == "joint_1");
}

}  // namespace

int main(int count, char ** arguments)
{
  robots = count > 1 ? arguments[1] : "../../robots";
  const std::vector<std::pair<const char *, void (*)()>> tests = {
    {"the arm has the bits of the C interface", the_arm_has_the_bits_of_the_c_interface},
    {"a still arm sags and stays", a_still_arm_sags_and_stays},
    {"the clock keeps what is no whole step", the_clock_keeps_what_is_no_whole_step},
    {"uneven periods do not shake the arm", uneven_periods_do_not_shake_the_arm},
    {"the step divides the period", the_step_divides_the_period},
    {"velocities and positions with velocities arrive at the same place",
      velocities_and_positions_with_velocities_arrive_at_the_same_place},
    {"servos follow, and an effort is added to theirs",
      servos_follow_and_an_effort_is_added_to_theirs},
    {"open servos hold until a torque moves them", open_servos_hold_until_a_torque_moves_them},
    {"a controller closes the loop", a_controller_closes_the_loop},
    {"forces on the TCP are inputs", forces_on_the_tcp_are_inputs},
    {"what makes no sense is refused with a remedy", what_makes_no_sense_is_refused_with_a_remedy}};
  for (const auto & [name, test] : tests) {
    std::printf("%s\n", name);
    try {
      test();
    } catch (const std::exception & error) {
      holds(error.what(), false);
    }
  }
  std::printf("%s\n", failures == 0 ? "all hold" : "some fail");
  return failures == 0 ? 0 : 1;
}
