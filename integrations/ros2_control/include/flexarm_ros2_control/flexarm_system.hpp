// A flexible arm as hardware of ros2_control.
//
// read() simulates the period that has passed with the last commands and publishes the states;
// write() takes new commands. Between deactivation and activation the arm stands still in time.

#ifndef FLEXARM_ROS2_CONTROL__FLEXARM_SYSTEM_HPP_
#define FLEXARM_ROS2_CONTROL__FLEXARM_SYSTEM_HPP_

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "flexarm_ros2_control/commanded_arm.hpp"
#include "flexarm_ros2_control/settings.hpp"
#include "hardware_interface/system_interface.hpp"
#include "rclcpp/duration.hpp"
#include "rclcpp/time.hpp"
#include "rclcpp_lifecycle/state.hpp"

namespace flexarm_ros2_control
{

class FlexarmSystem : public hardware_interface::SystemInterface
{
public:
  using CallbackReturn = hardware_interface::CallbackReturn;
  using State = rclcpp_lifecycle::State;

  /// Checks hardware parameters and interfaces; loads nothing.
  CallbackReturn on_init(
    const hardware_interface::HardwareComponentInterfaceParams & params) override;

  /// Loads the robot and starts it at rest at the initial values of the joints.
  CallbackReturn on_configure(const State & previous) override;
  /// Lets time run, with commands that hold the arm.
  CallbackReturn on_activate(const State & previous) override;
  /// Stops time.
  CallbackReturn on_deactivate(const State & previous) override;
  /// Frees the arm.
  CallbackReturn on_cleanup(const State & previous) override;
  CallbackReturn on_shutdown(const State & previous) override;
  CallbackReturn on_error(const State & previous) override;

  /// Sets velocities to zero when their controller stops.
  hardware_interface::return_type perform_command_mode_switch(
    const std::vector<std::string> & start_interfaces,
    const std::vector<std::string> & stop_interfaces) override;

  hardware_interface::return_type read(
    const rclcpp::Time & time, const rclcpp::Duration & period) override;
  hardware_interface::return_type write(
    const rclcpp::Time & time, const rclcpp::Duration & period) override;

private:
  using StateHandle = hardware_interface::StateInterface::SharedPtr;
  using CommandHandle = hardware_interface::CommandInterface::SharedPtr;

  /// A state interface and the number that it shows.
  struct JointReading
  {
    StateHandle handle;
    std::size_t joint;
    double JointState::* number;
  };

  /// A command interface and the number that it sets.
  struct JointOrder
  {
    CommandHandle handle;
    std::size_t joint;
    double JointCommand::* number;
  };

  /// An output or input of the plant and its place in the arm.
  template<typename Handle>
  struct Other
  {
    Handle handle;
    std::size_t place;
  };

  void check_joint(const hardware_interface::ComponentInfo & joint) const;
  std::vector<double> initial_pose() const;
  void find_interfaces();
  void hold();
  void publish();
  void drop();

  Settings settings_;
  std::unique_ptr<CommandedArm> arm_;
  std::vector<JointReading> joint_readings_;
  std::vector<JointOrder> joint_orders_;
  std::vector<JointCommand> commands_;
  std::vector<Other<StateHandle>> sensor_readings_;
  std::vector<Other<CommandHandle>> gpio_orders_;
  bool running_ = false;
};

}  // namespace flexarm_ros2_control

#endif  // FLEXARM_ROS2_CONTROL__FLEXARM_SYSTEM_HPP_
