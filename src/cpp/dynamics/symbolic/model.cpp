#include "archive.hpp"
#include "parts.hpp"

namespace hovi::symbolic {

SymbolicModel::SymbolicModel(const std::string& archive) {
  const auto model = read_archive(archive).cast<SX>();
  parts_.reset(new Parts{model, pinocchio::DataTpl<SX>(model), SX::sym("q", model.nq),
                         SX::sym("v", model.nv), SX::sym("a", model.nv)});
  // n^3 expressions each, and never used here: 300 MB on a robot of 100 joints.
  auto& data = parts_->data;
  for (auto* tensor : {&data.d2tau_dqdq, &data.d2tau_dvdv, &data.d2tau_dqdv, &data.d2tau_dadq})
    tensor->resize(0, 0, 0);
}

SymbolicModel::~SymbolicModel() = default;

}  // namespace hovi::symbolic
