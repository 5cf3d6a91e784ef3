// An arm that gets joint commands and runs by the clock of a controller.
//
// A plant simulates whole solver steps, a controller has periods of any length. The arm is never
// more than half a solver step away from the controller's time, and moves commands by what it is
// away: a command that comes 0.1 ms late at 1 rad/s would else be a jerk that shakes the arm. Start
// at CommandedArm::advance. This header knows nothing of ROS.

#ifndef FLEXARM_ROS2_CONTROL__COMMANDED_ARM_HPP_
#define FLEXARM_ROS2_CONTROL__COMMANDED_ARM_HPP_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "flexarm_ros2_control/flexarm_plant.hpp"
#include "flexarm_ros2_control/settings.hpp"

namespace flexarm_ros2_control
{

/// Commands to a joint (rad or m, rad/s or m/s, N m or N). What is NaN stays as it was.
struct JointCommand
{
  double position = std::numeric_limits<double>::quiet_NaN();
  double velocity = std::numeric_limits<double>::quiet_NaN();
  double effort = std::numeric_limits<double>::quiet_NaN();
};

/// Measured state of a joint: motor side, torque of the drive, and link side behind the gearbox.
struct JointState
{
  double position;
  double velocity;
  double effort;
  double link_position;
  double link_velocity;
};

/// A name as part of a variable's name: quoted unless it is an identifier.
inline std::string part(const std::string & name)
{
  const auto letter = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    };
  const auto plain = [&](char c) {return letter(c) || (c >= '0' && c <= '9');};
  if (!name.empty() && letter(name[0]) && std::all_of(name.begin(), name.end(), plain)) {
    return name;
  }
  std::string quoted = "'";
  for (const char c : name) {
    if (c == '\'' || c == '\\') {
      quoted += '\\';
    }
    quoted += c;
  }
  return quoted + "'";
}

/// An arm under commands, joints in the order of the caller.
class CommandedArm
{
public:
  /// Loads the robot and sets its parameters. `joints` are all driven joints of the robot.
  CommandedArm(const Settings & settings, const std::vector<std::string> & joints)
  : settings_(settings), plant_(settings.robot, settings.links, settings.drives)
  {
    set_parameters();
    find_joints(joints);
  }

  /// Adds an output of the plant to those that are read; returns its place for `output`.
  std::size_t watch(const std::string & variable)
  {
    const auto found = plant_.find(variable, FLEXARM_OUTPUT);
    if (!found) {
      throw ArmError(unknown("output", variable, FLEXARM_OUTPUT));
    }
    outputs_.push_back(*found);
    values_.push_back(0.0);
    return outputs_.size() - 1;
  }

  /// Adds an input of the plant, such as tcp.force.x, to those that are set; returns its place for
  /// `set_input`.
  std::size_t drive(const std::string & variable)
  {
    const auto found = plant_.find(variable, FLEXARM_INPUT);
    if (!found || variable.rfind("joint.", 0) == 0) {
      throw ArmError(unknown("input", variable, FLEXARM_INPUT));
    }
    return add_input(*found);
  }

  /// Starts at rest at a pose, in static equilibrium; what is NaN in the pose is zero.
  void start(const std::vector<double> & pose)
  {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      Joint & joint = joints_[k];
      joint.target = std::isfinite(pose.at(k)) ? pose[k] : 0.0;
      given_[joint.target_position] = joint.target;
    }
    plant_.set(inputs_, given_);
    plant_.start();
    look();
    behind_s_ = 0.0;
    hold();
  }

  /// Holds the arm: closed servos at the targets of now, open ones with the torques of now.
  void hold()
  {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      Joint & joint = joints_[k];
      const double torque = settings_.mode == CommandMode::effort ? state(k).effort : 0.0;
      joint.command = {joint.target, 0.0, torque};
      joint.position = {};
      joint.velocity = {};
    }
    since_command_s_ = 0.0;
    interval_s_ = 0.0;
  }

  /// The commands of now.
  const JointCommand & commanded(std::size_t joint) const {return joints_[joint].command;}

  /// Sets the commands to all joints, held until the next ones.
  void command(const std::vector<JointCommand> & commands)
  {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      JointCommand & now = joints_[k].command;
      const JointCommand before = now;
      for (const auto number :
        {&JointCommand::position, &JointCommand::velocity, &JointCommand::effort})
      {
        const double value = commands.at(k).*number;
        if (std::isinf(value)) {
          throw ArmError("joint " + joints_[k].name + " is commanded to infinity");
        }
        if (!std::isnan(value)) {
          now.*number = value;
        }
      }
      if (since_command_s_ > 0.0) {
        const double both_s = since_command_s_ + interval_s_;
        joints_[k].position.add((now.position - before.position) / since_command_s_, both_s);
        joints_[k].velocity.add((now.velocity - before.velocity) / since_command_s_, both_s);
      }
    }
    if (since_command_s_ > 0.0) {
      interval_s_ = since_command_s_;
    }
    since_command_s_ = 0.0;
  }

  /// Sets an input of `drive`, held until the next value. NaN changes nothing.
  void set_input(std::size_t place, double value)
  {
    if (!std::isnan(value)) {
      given_[place] = value;
    }
  }

  JointState state(std::size_t joint) const
  {
    const double * first = &values_[joints_[joint].first_output];
    return {first[0], first[1], first[2], first[3], first[4]};
  }

  double output(std::size_t place) const {return values_[place];}

  /// Simulated time (s).
  double time_s() const {return plant_.time_s();}

  /// Step size of the solver (s).
  double step_s() const {return step_s_;}

  /// Simulates a period of the controller with the commands as they are, to the nearest whole step.
  ///
  /// A command is the target one nominal period after it was given. Where the plant stops earlier
  /// or later, the target is moved along the parabola through the last three commands.
  ///
  /// Returns the time (s) that was left out because the period is longer than allowed.
  double advance(double period_s)
  {
    const double taken_s = std::clamp(period_s, 0.0, settings_.longest_s);
    behind_s_ += taken_s;
    since_command_s_ += taken_s;
    const double steps = std::floor(behind_s_ / step_s_ + 0.5);
    if (steps >= 1.0) {
      const double length_s = steps * step_s_;
      behind_s_ -= length_s;
      set_targets(length_s);
      plant_.step(length_s);
      look();
    }
    return std::max(period_s - taken_s, 0.0);
  }

private:
  /// Divided differences of the last three values of a command.
  struct Trend
  {
    void add(double new_slope, double both_s)
    {
      bend = (new_slope - slope) / both_s;
      slope = new_slope;
    }

    /// Change of the parabola in `lead_s` after the last value, `interval_s` after the one before.
    double ahead(double lead_s, double interval_s) const
    {
      return lead_s * (slope + (lead_s + interval_s) * bend);
    }

    double slope = 0.0;
    double bend = 0.0;
  };

  struct Joint
  {
    std::string name;
    /// Commands of now, none of them NaN.
    JointCommand command;
    Trend position;
    Trend velocity;
    // Places of the inputs in given_; there is no torque without a servo.
    std::size_t target_position;
    std::size_t target_velocity;
    std::optional<std::size_t> torque_input;
    /// Place of the first of five outputs in values_.
    std::size_t first_output;
    /// Targets at the end of the last step.
    double target = 0.0;
    double target_rate = 0.0;
  };

  void set_parameters()
  {
    for (const auto & [name, value] : settings_.parameters) {
      const auto found = plant_.find(name, FLEXARM_PARAMETER);
      if (!found) {
        throw ArmError(
          unknown("hardware parameter", name, FLEXARM_PARAMETER) + ", the plugin " + own_names);
      }
      plant_.set(*found, value);
    }
    if (settings_.mode == CommandMode::effort) {
      const auto open = plant_.find("open_servos");
      if (!open) {
        throw ArmError(
          "command_mode = \"effort\" needs servos, and the robot has none: set drives to servo");
      }
      plant_.set(*open, 1.0);
    }
    const bool with_velocity =
      settings_.mode == CommandMode::position_velocity || settings_.mode == CommandMode::velocity;
    plant_.set(plant_.find("use_target_velocity").value(), with_velocity ? 1.0 : 0.0);

    // A nominal period is a whole number of solver steps, unless the user chose the step.
    const std::uint32_t step = plant_.find("step").value();
    step_s_ = plant_.get(step);
    if (settings_.period_s > 0.0 && settings_.parameters.count("step") == 0) {
      step_s_ = settings_.period_s / std::ceil(settings_.period_s / step_s_ - 1e-6);
      plant_.set(step, step_s_);
    }
  }

  void find_joints(const std::vector<std::string> & joints)
  {
    std::size_t in_robot = 0;
    for (const auto & name : plant_.names(FLEXARM_INPUT)) {
      const std::string ending = ".target_position";
      in_robot += name.size() > ending.size() &&
        name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
    }
    for (const auto & joint : joints) {
      find_joint(joint);
    }
    if (in_robot != joints.size()) {
      throw ArmError(
        "the robot has " + std::to_string(in_robot) + " driven joints, the ros2_control tag " +
        std::to_string(joints.size()) + ": it must name them all");
    }
  }

  void find_joint(const std::string & name)
  {
    if (name.rfind(settings_.prefix, 0) != 0) {
      throw ArmError("joint " + name + " does not start with the prefix " + settings_.prefix);
    }
    const std::string of_joint = "joint." + part(name.substr(settings_.prefix.size())) + ".";
    const auto position = plant_.find(of_joint + "target_position");
    if (!position) {
      throw ArmError(
        "joint " + name + " is not a driven joint of the robot: mimic and fixed joints have no "
        "place in the ros2_control tag");
    }
    Joint joint;
    joint.name = name;
    joint.target_position = add_input(*position);
    joint.target_velocity = add_input(plant_.find(of_joint + "target_velocity").value());
    if (const auto torque = plant_.find(of_joint + "torque")) {
      joint.torque_input = add_input(*torque);
    } else if (settings_.mode == CommandMode::effort) {
      throw ArmError("joint " + name + " has no servo to command by effort: set drives to servo");
    }
    joint.first_output = values_.size();
    for (const char * what :
      {"motor_position", "motor_velocity", "effort", "link_position", "link_velocity"})
    {
      watch(of_joint + what);
    }
    joints_.push_back(joint);
  }

  std::size_t add_input(std::uint32_t reference)
  {
    inputs_.push_back(reference);
    given_.push_back(0.0);
    return inputs_.size() - 1;
  }

  std::string unknown(
    const std::string & what, const std::string & name, flexarm_causality_of causality) const
  {
    std::string text = "there is no " + what + " " + name + "; the robot has";
    for (const auto & known : plant_.names(causality)) {
      const bool own = known == "open_servos" || known == "use_target_velocity";
      if (!own && known.rfind("joint.", 0) != 0) {
        text += " " + known;
      }
    }
    return text;
  }

  /// Turns commands into the inputs at the end of the next `length_s`.
  void set_targets(double length_s)
  {
    const double lag_s = settings_.period_s > 0.0 ? settings_.period_s : since_command_s_;
    const double lead_s = since_command_s_ - lag_s - behind_s_;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      Joint & joint = joints_[k];
      const double rate_before = joint.target_rate;
      joint.target_rate = joint.command.velocity + joint.velocity.ahead(lead_s, interval_s_);
      switch (settings_.mode) {
        case CommandMode::position:
        case CommandMode::position_velocity:
          joint.target = joint.command.position + joint.position.ahead(lead_s, interval_s_);
          break;
        case CommandMode::velocity:
          // Constant acceleration from the last velocity to this one.
          joint.target += length_s * 0.5 * (rate_before + joint.target_rate);
          break;
        case CommandMode::effort: {
            // Nothing follows the targets; the rigid arm of the TCP error is at the motors.
            const JointState now = state(k);
            joint.target = now.position + length_s * now.velocity;
            break;
          }
      }
      given_[joint.target_position] = joint.target;
      given_[joint.target_velocity] = joint.target_rate;
      if (joint.torque_input) {
        given_[*joint.torque_input] = joint.command.effort;
      }
    }
    plant_.set(inputs_, given_);
  }

  void look() {plant_.get(outputs_, values_);}

  Settings settings_;
  FlexarmPlant plant_;
  std::vector<Joint> joints_;
  std::vector<std::uint32_t> inputs_;
  std::vector<double> given_;
  std::vector<std::uint32_t> outputs_;
  std::vector<double> values_;
  double step_s_ = 0.0;
  /// Time of the controller less that of the plant (s).
  double behind_s_ = 0.0;
  /// Time of the controller since the last commands (s).
  double since_command_s_ = 0.0;
  /// Time between the last two commands (s).
  double interval_s_ = 0.0;
};

}  // namespace flexarm_ros2_control

#endif  // FLEXARM_ROS2_CONTROL__COMMANDED_ARM_HPP_
