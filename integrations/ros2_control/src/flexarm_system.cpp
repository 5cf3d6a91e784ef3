#include "flexarm_ros2_control/flexarm_system.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "hardware_interface/types/hardware_interface_type_values.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "rclcpp/logging.hpp"

namespace flexarm_ros2_control
{

using hardware_interface::ComponentInfo;
using hardware_interface::InterfaceInfo;
using hardware_interface::return_type;

namespace
{

const std::map<std::string, double JointState::*> joint_states = {
  {hardware_interface::HW_IF_POSITION, &JointState::position},
  {hardware_interface::HW_IF_VELOCITY, &JointState::velocity},
  {hardware_interface::HW_IF_EFFORT, &JointState::effort},
  {"link_position", &JointState::link_position},
  {"link_velocity", &JointState::link_velocity}};

const std::map<std::string, double JointCommand::*> joint_commands = {
  {hardware_interface::HW_IF_POSITION, &JointCommand::position},
  {hardware_interface::HW_IF_VELOCITY, &JointCommand::velocity},
  {hardware_interface::HW_IF_EFFORT, &JointCommand::effort}};

/// Returns words between commas.
template<typename Words>
std::string listed(const Words & words)
{
  std::string text;
  for (const auto & word : words) {
    text += (text.empty() ? "" : ", ") + word;
  }
  return text;
}

template<typename Value>
std::vector<std::string> keys(const std::map<std::string, Value> & map)
{
  std::vector<std::string> keys;
  std::transform(
    map.begin(), map.end(), std::back_inserter(keys), [](const auto & entry) {return entry.first;});
  return keys;
}

std::string full_name(const ComponentInfo & component, const InterfaceInfo & interface)
{
  return component.name + "/" + interface.name;
}

void check_type(const ComponentInfo & component, const InterfaceInfo & interface)
{
  if (interface.data_type != "double") {
    throw ArmError(
      full_name(component, interface) + " has the type " + interface.data_type +
      ": expected double");
  }
}

/// Returns the variable of an interface of a sensor or gpio: tcp.position.x for position.x of tcp.
std::string variable_of(const ComponentInfo & component, const InterfaceInfo & interface)
{
  const auto given = component.parameters.find("variable");
  const bool own = given == component.parameters.end();
  return (own ? component.name : given->second) + "." + interface.name;
}

}  // namespace

FlexarmSystem::CallbackReturn FlexarmSystem::on_init(
  const hardware_interface::HardwareComponentInterfaceParams & params)
{
  if (SystemInterface::on_init(params) != CallbackReturn::SUCCESS) {
    return CallbackReturn::ERROR;
  }
  try {
    const double period_s = info_.rw_rate > 0 ? 1.0 / info_.rw_rate : 0.0;
    settings_ = settings_of(info_.hardware_parameters, period_s);
    for (const auto & joint : info_.joints) {
      check_joint(joint);
    }
    initial_pose();
    for (const auto & sensor : info_.sensors) {
      for (const auto & interface : sensor.state_interfaces) {
        check_type(sensor, interface);
      }
    }
    for (const auto & gpio : info_.gpios) {
      if (!gpio.state_interfaces.empty()) {
        throw ArmError(
          "gpio " + gpio.name + " has state interfaces: outputs of the arm belong to a sensor");
      }
      for (const auto & interface : gpio.command_interfaces) {
        check_type(gpio, interface);
      }
    }
  } catch (const std::exception & error) {
    RCLCPP_FATAL(get_logger(), "%s", error.what());
    return CallbackReturn::ERROR;
  }
  return CallbackReturn::SUCCESS;
}

void FlexarmSystem::check_joint(const ComponentInfo & joint) const
{
  std::set<std::string> found;
  for (const auto & interface : joint.command_interfaces) {
    check_type(joint, interface);
    found.insert(interface.name);
  }
  // An effort beside other commands is added to the torque of the servo.
  const std::set<std::string> needed = commanded(settings_.mode);
  std::set<std::string> with_effort = needed;
  with_effort.insert(hardware_interface::HW_IF_EFFORT);
  if (found != needed && found != with_effort) {
    throw ArmError(
      "joint " + joint.name + " has the command interfaces [" + listed(found) +
      "]: this command_mode needs [" + listed(needed) + "], and effort may be added to a servo");
  }

  for (const auto & interface : joint.state_interfaces) {
    check_type(joint, interface);
    if (joint_states.count(interface.name) == 0) {
      throw ArmError(
        "joint " + joint.name + " has the state interface " + interface.name +
        ": expected some of " + listed(keys(joint_states)));
    }
  }
}

std::vector<double> FlexarmSystem::initial_pose() const
{
  std::vector<double> pose;
  for (const auto & joint : info_.joints) {
    double value = 0.0;
    for (const auto & interface : joint.state_interfaces) {
      const bool is_position = interface.name == hardware_interface::HW_IF_POSITION;
      if (is_position && !interface.initial_value.empty()) {
        value = number("initial_value of " + full_name(joint, interface), interface.initial_value);
      }
    }
    pose.push_back(value);
  }
  return pose;
}

FlexarmSystem::CallbackReturn FlexarmSystem::on_configure(const State & /*previous*/)
{
  drop();
  try {
    std::vector<std::string> joints;
    for (const auto & joint : info_.joints) {
      joints.push_back(joint.name);
    }
    arm_ = std::make_unique<CommandedArm>(settings_, joints);
    find_interfaces();
    arm_->start(initial_pose());
    hold();
    publish();
  } catch (const std::exception & error) {
    RCLCPP_ERROR(get_logger(), "%s", error.what());
    drop();
    return CallbackReturn::FAILURE;
  }
  RCLCPP_INFO(
    get_logger(), "%s: %zu joints, solver steps of %g ms, flexarm %s", settings_.robot.c_str(),
    info_.joints.size(), 1e3 * arm_->step_s(), flexarm_version());
  if (settings_.period_s > 0.0 && settings_.period_s < 0.999 * arm_->step_s()) {
    RCLCPP_WARN(
      get_logger(), "a period of %g ms is shorter than a solver step: states change every few "
      "periods only; leave the hardware parameter step out, or make it smaller",
      1e3 * settings_.period_s);
  }
  return CallbackReturn::SUCCESS;
}

void FlexarmSystem::find_interfaces()
{
  commands_.resize(info_.joints.size());
  for (std::size_t k = 0; k < info_.joints.size(); ++k) {
    const auto & joint = info_.joints[k];
    for (const auto & interface : joint.state_interfaces) {
      joint_readings_.push_back(
        {get_state_interface_handle(full_name(joint, interface)), k,
          joint_states.at(interface.name)});
    }
    for (const auto & interface : joint.command_interfaces) {
      joint_orders_.push_back(
        {get_command_interface_handle(full_name(joint, interface)), k,
          joint_commands.at(interface.name)});
    }
  }
  for (const auto & sensor : info_.sensors) {
    for (const auto & interface : sensor.state_interfaces) {
      sensor_readings_.push_back(
        {get_state_interface_handle(full_name(sensor, interface)),
          arm_->watch(variable_of(sensor, interface))});
    }
  }
  for (const auto & gpio : info_.gpios) {
    for (const auto & interface : gpio.command_interfaces) {
      gpio_orders_.push_back(
        {get_command_interface_handle(full_name(gpio, interface)),
          arm_->drive(variable_of(gpio, interface))});
    }
  }
}

/// Holds the arm and shows it in the command interfaces.
void FlexarmSystem::hold()
{
  arm_->hold();
  for (std::size_t k = 0; k < commands_.size(); ++k) {
    commands_[k] = arm_->commanded(k);
  }
  for (const auto & order : joint_orders_) {
    std::ignore = set_command(order.handle, commands_[order.joint].*order.number, true);
  }
  for (const auto & order : gpio_orders_) {
    arm_->set_input(order.place, 0.0);
    std::ignore = set_command(order.handle, 0.0, true);
  }
}

void FlexarmSystem::publish()
{
  // A value that a reader locks at this moment is published in the next period.
  for (const auto & reading : joint_readings_) {
    const JointState state = arm_->state(reading.joint);
    std::ignore = set_state(reading.handle, state.*reading.number, false);
  }
  for (const auto & reading : sensor_readings_) {
    std::ignore = set_state(reading.handle, arm_->output(reading.place), false);
  }
}

void FlexarmSystem::drop()
{
  running_ = false;
  joint_readings_.clear();
  joint_orders_.clear();
  sensor_readings_.clear();
  gpio_orders_.clear();
  commands_.clear();
  arm_.reset();
}

FlexarmSystem::CallbackReturn FlexarmSystem::on_activate(const State & /*previous*/)
{
  hold();
  running_ = true;
  return CallbackReturn::SUCCESS;
}

FlexarmSystem::CallbackReturn FlexarmSystem::on_deactivate(const State & /*previous*/)
{
  running_ = false;
  return CallbackReturn::SUCCESS;
}

FlexarmSystem::CallbackReturn FlexarmSystem::on_cleanup(const State & /*previous*/)
{
  drop();
  return CallbackReturn::SUCCESS;
}

FlexarmSystem::CallbackReturn FlexarmSystem::on_shutdown(const State & /*previous*/)
{
  drop();
  return CallbackReturn::SUCCESS;
}

FlexarmSystem::CallbackReturn FlexarmSystem::on_error(const State & /*previous*/)
{
  // The arm is loaded anew when the component is configured again.
  drop();
  return CallbackReturn::SUCCESS;
}

return_type FlexarmSystem::perform_command_mode_switch(
  const std::vector<std::string> & /*start_interfaces*/,
  const std::vector<std::string> & stop_interfaces)
{
  for (const auto & order : joint_orders_) {
    const bool stops = std::find(
      stop_interfaces.begin(), stop_interfaces.end(),
      order.handle->get_name()) != stop_interfaces.end();
    if (stops && order.number == &JointCommand::velocity) {
      std::ignore = set_command(order.handle, 0.0, true);
    }
  }
  return return_type::OK;
}

return_type FlexarmSystem::read(const rclcpp::Time & /*time*/, const rclcpp::Duration & period)
{
  if (!arm_) {
    return return_type::OK;
  }
  try {
    const double left_out_s = running_ ? arm_->advance(period.seconds()) : 0.0;
    if (left_out_s > 0.0) {
      RCLCPP_WARN_THROTTLE(
        get_logger(), *get_clock(), 1000,
        "a period of %.3f s is longer than max_period (%.3f s): the arm falls behind by the rest",
        period.seconds(), settings_.longest_s);
    }
  } catch (const std::exception & error) {
    RCLCPP_ERROR(
      get_logger(), "step after %.6f s of simulation: %s", arm_->time_s(), error.what());
    return return_type::ERROR;
  }
  publish();
  return return_type::OK;
}

return_type FlexarmSystem::write(const rclcpp::Time & /*time*/, const rclcpp::Duration & /*period*/)
{
  if (!arm_) {
    return return_type::OK;
  }
  for (const auto & order : joint_orders_) {
    // A command that is locked at this moment stays as it was.
    double value = std::numeric_limits<double>::quiet_NaN();
    if (get_command(order.handle, value, false)) {
      commands_[order.joint].*order.number = value;
    }
  }
  try {
    arm_->command(commands_);
  } catch (const std::exception & error) {
    RCLCPP_ERROR(get_logger(), "%s", error.what());
    return return_type::ERROR;
  }
  for (const auto & order : gpio_orders_) {
    double value = std::numeric_limits<double>::quiet_NaN();
    if (get_command(order.handle, value, false)) {
      arm_->set_input(order.place, value);
    }
  }
  return return_type::OK;
}

}  // namespace flexarm_ros2_control

PLUGINLIB_EXPORT_CLASS(
  flexarm_ros2_control::FlexarmSystem, hardware_interface::SystemInterface)
