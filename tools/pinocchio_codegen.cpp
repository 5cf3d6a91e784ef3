// C code of Pinocchio's recursions on models given as text (see pinocchio_bench.sh), each operation written out by CasADi.
//
//     pinocchio_codegen FOLDER < MODELS
//
// Writes FOLDER/recursions.c and FOLDER/table.inc, the lines of pinocchio_codegen_bench.c.
#include <pinocchio/autodiff/casadi.hpp>

#include "pinocchio_models.hpp"

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <casadi/casadi.hpp>
#include <fstream>

using casadi::Function;
using casadi::SX;

int main(int argc, char** argv)
{
  if (argc != 2) {
    std::cerr << "usage: pinocchio_codegen FOLDER < MODELS\n";
    return 2;
  }
  const std::string folder = std::string(argv[1]) + "/";
  casadi::CodeGenerator code("recursions.c");
  std::ofstream table(folder + "table.inc");
  for (const auto& named : read_models(std::cin)) {
    const auto model = named.model.cast<SX>();
    pinocchio::DataTpl<SX> data(model);
    using Vector = Eigen::Matrix<SX, Eigen::Dynamic, 1>;
    const SX q = SX::sym("q", model.nq), v = SX::sym("v", model.nv), a = SX::sym("a", model.nv);
    Vector q_e(model.nq), v_e(model.nv), a_e(model.nv);
    pinocchio::casadi::copy(q, q_e);
    pinocchio::casadi::copy(v, v_e);
    pinocchio::casadi::copy(a, a_e);
    const auto add = [&](const char* what, const std::vector<SX>& in, const SX& out) {
      const std::string name = named.name + "_" + what;
      code.add(Function(name, in, {out}));
      table << "LINE(" << named.name << ", " << what << ", " << in.size() << ")\n";
    };
    SX tau(model.nv, 1), M(model.nv, model.nv), acceleration(model.nv, 1);
    pinocchio::casadi::copy(pinocchio::rnea(model, data, q_e, v_e, a_e), tau);
    add("rnea", {q, v, a}, tau);
    pinocchio::crba(model, data, q_e, pinocchio::Convention::LOCAL);
    pinocchio::casadi::copy(data.M, M);
    add("crba", {q}, triu(M));
    pinocchio::casadi::copy(pinocchio::aba(model, data, q_e, v_e, a_e, pinocchio::Convention::LOCAL), acceleration);
    add("aba", {q, v, a}, acceleration);
  }
  code.generate(folder);
  return 0;
}
