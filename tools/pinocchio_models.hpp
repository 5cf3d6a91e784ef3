// Models given as text (the example reference_arm_text describes the format) for the programs of pinocchio_bench.sh.
#pragma once

#include <pinocchio/multibody.hpp>

#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

struct NamedModel { std::string name; pinocchio::Model model; };

/// Adds the body of one line to the model.
inline void add_body(pinocchio::Model& model, std::istringstream& line, const std::string& kind)
{
  pinocchio::JointIndex parent;
  Eigen::Vector3d axis, p, com;
  Eigen::Matrix3d R, I;
  double mass, xx, xy, xz, yy, yz, zz;
  line >> parent >> axis[0] >> axis[1] >> axis[2];
  for (int i = 0; i < 9; ++i) line >> R(i / 3, i % 3);
  line >> p[0] >> p[1] >> p[2] >> mass >> com[0] >> com[1] >> com[2] >> xx >> xy >> xz >> yy >> yz >> zz;
  if (!line) throw std::runtime_error("line too short: " + line.str());
  I << xx, xy, xz, xy, yy, yz, xz, yz, zz;

  // Axes along x, y, z have joint types of their own, which are faster.
  pinocchio::JointModel joint;
  if (kind == "elastic") joint = pinocchio::JointModelFreeFlyer();
  else if (kind == "prismatic") joint = pinocchio::JointModelPrismaticUnaligned(axis);
  else if (axis == Eigen::Vector3d::UnitX()) joint = pinocchio::JointModelRX();
  else if (axis == Eigen::Vector3d::UnitY()) joint = pinocchio::JointModelRY();
  else if (axis == Eigen::Vector3d::UnitZ()) joint = pinocchio::JointModelRZ();
  else joint = pinocchio::JointModelRevoluteUnaligned(axis);

  const auto id = model.addJoint(parent, joint, pinocchio::SE3(R, p), "joint_" + std::to_string(model.njoints));
  model.appendBodyToJoint(id, pinocchio::Inertia(mass, com, pinocchio::Symmetric3(I)), pinocchio::SE3::Identity());
}

inline std::vector<NamedModel> read_models(std::istream& in)
{
  std::vector<NamedModel> models;
  for (std::string text; std::getline(in, text);) {
    std::istringstream line(text);
    std::string word;
    line >> word;
    if (word == "model") {
      models.emplace_back();
      line >> models.back().name;
    } else if (!word.empty()) {
      add_body(models.back().model, line, word);
    }
  }
  return models;
}
