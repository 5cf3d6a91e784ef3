// Times of Pinocchio's recursions per call, in ns, on models given as text (see pinocchio_bench.sh).
//
// Input: the output of the example reference_arm_text, which describes the format. The elastic joint is one joint of
// six degrees of freedom (free flyer). Every function runs through 64 random states; 101 batches of 1000 calls each.
// Output: CSV build,model,function,minimum_ns,median_ns; then the sum of what was computed, so that nothing is left out.
#include "pinocchio_models.hpp"

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <string>
#include <utility>
#include <vector>

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double used = 0.0;  // results go in here

template <class Call>
void time_calls(const std::string& label, const char* function, Call&& call)
{
  constexpr int batches = 101, calls = 1000;
  std::vector<double> ns(batches);
  for (double& t : ns) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) used += call(i & 63);
    t = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count() / calls;
  }
  std::sort(ns.begin(), ns.end());
  std::printf("%s,%s,%.0f,%.0f\n", label.c_str(), function, ns.front(), ns[batches / 2]);
}

/// Coordinates of the joints with more than one degree of freedom.
std::vector<int> elastic_coordinates(const pinocchio::Model& model)
{
  std::vector<int> rows;
  for (const auto& joint : model.joints)
    for (int k = 0; joint.nv() > 1 && k < joint.nv(); ++k) rows.push_back(joint.idx_v() + k);
  return rows;
}

void bench(const std::string& build, NamedModel& named)
{
  const pinocchio::Model& model = named.model;
  pinocchio::Data data(model);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  const auto random = [&] { VectorXd x(model.nv); for (double& v : x) v = uniform(generator); return x; };
  std::vector<VectorXd> q, v, a;
  for (int i = 0; i < 64; ++i) {
    q.push_back(pinocchio::integrate(model, pinocchio::neutral(model), random()));
    v.push_back(random());
    a.push_back(random());
  }
  const std::string label = build + "," + named.name;

  time_calls(label, "forward_kinematics", [&](int i) {
    pinocchio::forwardKinematics(model, data, q[i]);
    return data.oMi.back().translation()[0];
  });
  time_calls(label, "rnea", [&](int i) { return pinocchio::rnea(model, data, q[i], v[i], a[i])[0]; });
  time_calls(label, "crba", [&](int i) { return pinocchio::crba(model, data, q[i], pinocchio::Convention::LOCAL)(0, 0); });
  time_calls(label, "aba", [&](int i) { return pinocchio::aba(model, data, q[i], v[i], a[i], pinocchio::Convention::LOCAL)[0]; });

  // Prescribed joints, free elastic ones: M_ee e'' = tau_e - h_e with q_a'' given.
  const std::vector<int> rows = elastic_coordinates(model);
  if (rows.empty()) return;
  const int n = static_cast<int>(rows.size());
  MatrixXd M(n, n);
  VectorXd right(n);
  Eigen::LLT<MatrixXd> factor(n);
  time_calls(label, "hybrid", [&](int i) {
    pinocchio::rnea(model, data, q[i], v[i], a[i]);
    pinocchio::crba(model, data, q[i], pinocchio::Convention::LOCAL);
    for (int r = 0; r < n; ++r) {
      right[r] = 0.1 - data.tau[rows[r]];
      for (int c = 0; c <= r; ++c) M(r, c) = data.M(rows[c], rows[r]);   // the upper triangle is filled
    }
    factor.compute(M);
    factor.solveInPlace(right);
    return right[0];
  });
}

}  // namespace

int main(int argc, char** argv)
{
  try {
    auto models = read_models(std::cin);
    for (auto& named : models) bench(argc > 1 ? argv[1] : "build", named);
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 1;
  }
  std::fprintf(stderr, "sum of all results: %.6g\n", used);
}
