// A flexible arm that another program steps: flexarm.h with ownership and exceptions.
//
// Variables are found by name once and used by reference; docs/fmu.md lists them. SI units and
// radians. This header knows nothing of ROS.

#ifndef FLEXARM_ROS2_CONTROL__FLEXARM_PLANT_HPP_
#define FLEXARM_ROS2_CONTROL__FLEXARM_PLANT_HPP_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "flexarm.h"

namespace flexarm_ros2_control
{

/// What the arm or its settings refuse; the message names the thing and a remedy.
class ArmError : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
};

/// A plant of flexarm.h.
class FlexarmPlant
{
public:
  /// Loads a robot file or URDF.
  ///
  /// `links` is rigid, lumped or modal, `drives` is rigid, elastic or servo; empty: as filed.
  FlexarmPlant(const std::string & robot, const std::string & links, const std::string & drives)
  : plant_(flexarm_open(
        robot.c_str(), links.empty() ? nullptr : links.c_str(),
        drives.empty() ? nullptr : drives.c_str(), 0.0, nullptr, 0))
  {
    check(plant_ ? 0 : -1);
  }

  /// Reference of a variable, if the plant has it.
  std::optional<std::uint32_t> find(const std::string & name) const
  {
    const int found = flexarm_find(plant_.get(), name.c_str());
    return found < 0 ? std::nullopt : std::make_optional(static_cast<std::uint32_t>(found));
  }

  /// Reference of a variable that is a parameter, an input or an output, if the plant has it.
  std::optional<std::uint32_t> find(const std::string & name, flexarm_causality_of causality) const
  {
    const auto found = find(name);
    return found && flexarm_causality(plant_.get(), *found) == causality ? found : std::nullopt;
  }

  /// Names of all parameters, inputs or outputs.
  std::vector<std::string> names(flexarm_causality_of causality) const
  {
    std::vector<std::string> names;
    for (std::uint32_t k = 0; k < flexarm_count(plant_.get()); ++k) {
      if (flexarm_causality(plant_.get(), k) == causality) {
        names.emplace_back(flexarm_name(plant_.get(), k));
      }
    }
    return names;
  }

  /// Sets parameters (before the start) and inputs.
  void set(const std::vector<std::uint32_t> & references, const std::vector<double> & values)
  {
    check(flexarm_set(plant_.get(), references.data(), values.data(), references.size()));
  }

  void set(std::uint32_t reference, double value)
  {
    check(flexarm_set(plant_.get(), &reference, &value, 1));
  }

  /// Reads variables into `values`, which has the size of `references`.
  void get(const std::vector<std::uint32_t> & references, std::vector<double> & values) const
  {
    check(flexarm_get(plant_.get(), references.data(), values.data(), references.size()));
  }

  double get(std::uint32_t reference) const
  {
    double value = 0.0;
    check(flexarm_get(plant_.get(), &reference, &value, 1));
    return value;
  }

  /// Starts at rest at the target positions, at time 0.
  void start() {check(flexarm_start(plant_.get(), 0.0));}

  /// Simulates `length_s`, a whole number of solver steps.
  void step(double length_s) {check(flexarm_step(plant_.get(), length_s));}

  /// Time since the start (s).
  double time_s() const {return flexarm_time(plant_.get());}

private:
  struct Free
  {
    void operator()(flexarm_plant * plant) const noexcept {flexarm_free(plant);}
  };

  static void check(int status)
  {
    if (status != 0) {
      throw ArmError(flexarm_error());
    }
  }

  std::unique_ptr<flexarm_plant, Free> plant_;
};

}  // namespace flexarm_ros2_control

#endif  // FLEXARM_ROS2_CONTROL__FLEXARM_PLANT_HPP_
