// Hardware parameters of the ros2_control tag, checked. This header knows nothing of ROS.

#ifndef FLEXARM_ROS2_CONTROL__SETTINGS_HPP_
#define FLEXARM_ROS2_CONTROL__SETTINGS_HPP_

#include <cmath>
#include <locale>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <unordered_map>

#include "flexarm_ros2_control/flexarm_plant.hpp"

namespace flexarm_ros2_control
{

/// What controllers command.
enum class CommandMode
{
  position,           ///< positions; joints follow the parabola through the last three
  position_velocity,  ///< positions with the velocities there
  velocity,           ///< velocities; positions are their integral
  effort              ///< torques of the motors, servos open
};

/// Names of the parameters that are not those of the plant.
constexpr const char * own_names = "robot links drives prefix command_mode max_period";

/// How an arm is made and stepped.
struct Settings
{
  std::string robot;
  std::string links;
  std::string drives;
  CommandMode mode = CommandMode::position;
  /// Nominal period (s); 0 if it is not known.
  double period_s = 0.0;
  /// Longest time that one read simulates (s).
  double longest_s = 0.1;
  /// What names of joints have before their name in the robot.
  std::string prefix;
  /// Parameters of the plant by name.
  std::map<std::string, double> parameters;
};

/// Reads a finite number in the notation of C, whatever the locale.
inline double number(const std::string & name, const std::string & text)
{
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double value = 0.0;
  if (!(stream >> value) || !(stream >> std::ws).eof() || !std::isfinite(value)) {
    throw ArmError(name + " = \"" + text + "\": expected a finite number");
  }
  return value;
}

/// Names of the command interfaces that every joint needs in a mode.
inline std::set<std::string> commanded(CommandMode mode)
{
  switch (mode) {
    case CommandMode::position: return {"position"};
    case CommandMode::position_velocity: return {"position", "velocity"};
    case CommandMode::velocity: return {"velocity"};
    default: return {"effort"};
  }
}

/// Checks hardware parameters.
///
/// * `period_s`: nominal period (s), 0 if it is not known.
///
/// Parameters with other names are kept for the plant, which knows its own.
inline Settings settings_of(
  const std::unordered_map<std::string, std::string> & given, double period_s)
{
  static const std::map<std::string, CommandMode> modes = {
    {"position", CommandMode::position},
    {"position_velocity", CommandMode::position_velocity},
    {"velocity", CommandMode::velocity},
    {"effort", CommandMode::effort}};
  Settings settings;
  settings.period_s = period_s;
  for (const auto & [name, text] : given) {
    if (name == "robot") {
      settings.robot = text;
    } else if (name == "links") {
      settings.links = text;
    } else if (name == "drives") {
      settings.drives = text;
    } else if (name == "prefix") {
      settings.prefix = text;
    } else if (name == "command_mode") {
      const auto mode = modes.find(text);
      if (mode == modes.end()) {
        throw ArmError(
          name + " = \"" + text + "\": expected position, position_velocity, velocity or effort");
      }
      settings.mode = mode->second;
    } else if (name == "max_period") {
      settings.longest_s = number(name, text);
    } else if (name == "open_servos" || name == "use_target_velocity") {
      throw ArmError(name + " follows from command_mode: leave it out");
    } else {
      settings.parameters[name] = number(name, text);
    }
  }

  if (settings.robot.empty()) {
    throw ArmError("there is no hardware parameter robot: give the path of a robot file or URDF");
  }
  if (!(settings.longest_s > 0.0)) {
    throw ArmError(
      "max_period = " + std::to_string(settings.longest_s) + " s: expected more than 0");
  }
  return settings;
}

}  // namespace flexarm_ros2_control

#endif  // FLEXARM_ROS2_CONTROL__SETTINGS_HPP_
