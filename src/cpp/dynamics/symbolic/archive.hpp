// Pinocchio's text archive of a model, after a checksum: what `hovi.dynamics.extension.archive` writes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include <pinocchio/multibody.hpp>
#include <pinocchio/serialization.hpp>

namespace hovi {

// Whether all lists have the lengths that the model states, and joints and frames refer to earlier
// ones: Pinocchio's algorithms index by these numbers without a check.
inline bool consistent(const pinocchio::Model& model) {
  const std::size_t n = model.joints.size(), frames = model.frames.size();
  bool holds = n > 0 && model.njoints == int(n) && model.nframes == int(frames);
  for (const std::size_t size :
       {model.inertias.size(), model.jointPlacements.size(), model.parents.size(),
        model.names.size(), model.idx_qs.size(), model.nqs.size(), model.idx_vs.size(),
        model.nvs.size(), model.children.size(), model.supports.size(), model.subtrees.size()})
    holds &= size == n;
  if (!holds) return false;
  // of the universe, from which Pinocchio takes the sizes of its data
  holds &= model.parents[0] == 0 && model.nqs[0] == 0 && model.nvs[0] == 0;
  int nq = 0, nv = 0;
  for (std::size_t i = 1; i < n; ++i) {
    const auto& joint = model.joints[i];
    holds &= model.parents[i] < i && joint.id() == i;
    holds &= joint.idx_q() == nq && model.idx_qs[i] == nq && model.nqs[i] == joint.nq();
    holds &= joint.idx_v() == nv && model.idx_vs[i] == nv && model.nvs[i] == joint.nv();
    nq += joint.nq(), nv += joint.nv();
  }
  for (const auto* lists : {&model.children, &model.supports, &model.subtrees})
    for (const auto& list : *lists)
      for (const std::size_t joint : list) holds &= joint < n;
  for (const auto& frame : model.frames)
    holds &= frame.parentJoint < n && frame.parentFrame < frames;
  for (const auto* vector :
       {&model.armature, &model.rotorInertia, &model.rotorGearRatio, &model.damping,
        &model.lowerDryFrictionLimit, &model.upperDryFrictionLimit, &model.lowerEffortLimit,
        &model.upperEffortLimit, &model.lowerVelocityLimit, &model.upperVelocityLimit,
        &model.lowerAccelerationLimit, &model.upperAccelerationLimit, &model.lowerJerkLimit,
        &model.upperJerkLimit})
    holds &= vector->size() == nv;
  for (const auto* vector :
       {&model.lowerPositionLimit, &model.upperPositionLimit, &model.positionLimitMargin})
    holds &= vector->size() == nq;
  return holds && model.nq == nq && model.nv == nv;
}

// The CRC-32 of zlib, as eight hexadecimal digits.
inline std::string checksum(const std::string& text, std::size_t from) {
  std::uint32_t crc = ~std::uint32_t(0);
  for (std::size_t i = from; i < text.size(); ++i) {
    crc ^= static_cast<unsigned char>(text[i]);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xedb88320u & -(crc & 1u));
  }
  char digits[9];
  std::snprintf(digits, sizeof digits, "%08x", unsigned(~crc));
  return digits;
}

// Takes a compiler 13 s: for one unit of a module alone. Throws ValueError for any other text.
//
// The checksum comes first, since Boost's reader of archives trusts the numbers in them: one changed
// character may write out of bounds.
inline pinocchio::Model read_archive(const std::string& archive) {
  constexpr std::size_t begin = 9;
  if (archive.size() < begin || archive[begin - 1] != ' ' ||
      archive.compare(0, begin - 1, checksum(archive, begin)) != 0)
    throw std::invalid_argument(
        "archive is damaged, as its checksum shows, or not one of hovi.dynamics.extension.archive.");
  pinocchio::Model model;
  try {
    model.loadFromString(archive.substr(begin));
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string("archive is not that of a model: ") + error.what());
  }
  if (!consistent(model))
    throw std::invalid_argument("archive is that of a model that contradicts itself.");
  return model;
}

}  // namespace hovi
