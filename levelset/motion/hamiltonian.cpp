#include "levelset/motion/hamiltonian.h"

#include <algorithm>
#include <cmath>

#include "core/vector_kernel.h"

namespace scarp {

namespace {

// What a kernel adds to is restricted: it overlaps with nothing else.

SCARP_KERNEL_PART Vec3f at_node(const RowVectors& vectors, int k) {
  return {vectors[0][k], vectors[1][k], vectors[2][k]};
}

SCARP_KERNEL_PART void add(const AngularRate& rate, float amplitude, int k, Hamiltonian& sum) {
  sum.value[k] += amplitude * rate.value;
  sum.slope[0][k] += amplitude * rate.slope.x;
  sum.slope[1][k] += amplitude * rate.slope.y;
  sum.slope[2][k] += amplitude * rate.slope.z;
}

SCARP_VECTOR_KERNEL bool is_zero(const float* amplitude) {
  int other = 0;
  for (int k = 0; k < leaf_edge; ++k) other |= amplitude[k] != 0 ? 1 : 0;
  return other == 0;
}

SCARP_VECTOR_KERNEL void add_isotropic(const float* speed, const RowVectors& p,
                                       Hamiltonian& __restrict sum) {
  for (int k = 0; k < leaf_edge; ++k) {
    const Vec3f gradient = at_node(p, k);
    const float size = length(gradient);
    add({size, gradient / larger(size, 1e-6F)}, speed[k], k, sum);
  }
}

SCARP_VECTOR_KERNEL void add_crystal(const CrystalRates& crystal, const float* amplitude,
                                     const RowVectors& p, Hamiltonian& __restrict sum) {
  for (int k = 0; k < leaf_edge; ++k) add(crystal.rate(at_node(p, k)), amplitude[k], k, sum);
}

/// Normals at the nodes of a row as factors about an axis see them.
struct AboutAxis {
  RowValues size;
  RowVectors normals;
  RowValues cosine;
};

SCARP_VECTOR_KERNEL AboutAxis about_axis(Vec3f axis, const RowVectors& p) {
  AboutAxis at;
  for (int k = 0; k < leaf_edge; ++k) {
    const Vec3f gradient = at_node(p, k);
    const float size = larger(length(gradient), 1e-6F);
    const Vec3f normal = gradient / size;
    at.size[k] = size;
    at.normals[0][k] = normal.x;
    at.normals[1][k] = normal.y;
    at.normals[2][k] = normal.z;
    at.cosine[k] = axial_cosine(axis, normal);
  }
  return at;
}

/// What factors about one axis add up to.
struct AxialSum {
  RowValues value{};
  RowValues rise{};
};

template <class Kind>
SCARP_KERNEL_PART void add_kind(const Kind& kind, const float* amplitude, const RowValues& cosine,
                                AxialSum& __restrict sum) {
  for (int k = 0; k < leaf_edge; ++k) {
    const AxialRate rate = kind.at(cosine[k]);
    sum.value[k] += amplitude[k] * rate.value;
    sum.rise[k] += amplitude[k] * rate.rise;
  }
}

SCARP_VECTOR_KERNEL void add(const BeamResponse& kind, const float* amplitude,
                             const RowValues& cosine, AxialSum& __restrict sum) {
  add_kind(kind, amplitude, cosine, sum);
}

SCARP_VECTOR_KERNEL void add(const CosineResponse& kind, const float* amplitude,
                             const RowValues& cosine, AxialSum& __restrict sum) {
  add_kind(kind, amplitude, cosine, sum);
}

SCARP_VECTOR_KERNEL void add(const SlopeResponse& kind, const float* amplitude,
                             const RowValues& cosine, AxialSum& __restrict sum) {
  add_kind(kind, amplitude, cosine, sum);
}

SCARP_VECTOR_KERNEL void add_axial(Vec3f axis, const AboutAxis& at, const AxialSum& axial,
                                   Hamiltonian& __restrict sum) {
  for (int k = 0; k < leaf_edge; ++k) {
    const AxialRate of_cosine{axial.value[k], axial.rise[k]};
    add(rate_about(axis, at.size[k], at_node(at.normals, k), of_cosine), 1, k, sum);
  }
}

/// Adds the angular parts of a field from a given one on that have its axis, and returns the number
/// of the next one.
std::size_t add_about_axis(const SpeedField& field, std::size_t part, std::size_t first,
                           const RowVectors& p, Hamiltonian& sum) {
  const Vec3f axis = *field.angular[part].factor.axis();
  const AboutAxis at = about_axis(axis, p);
  const auto [least, most] = std::minmax_element(at.cosine.begin(), at.cosine.end());
  AxialSum axial;
  for (; part < field.angular.size() && field.angular[part].factor.axis() == axis; ++part) {
    const auto& [factor, amplitudes] = field.angular[part];
    const float* amplitude = &amplitudes[first];
    const SlopeResponse* slopes = factor.between_slopes();
    if (slopes != nullptr && slopes->is_zero_between(*least, *most)) continue;
    if (is_zero(amplitude)) continue;
    factor.visit([&](const auto& kind) {
      if constexpr (requires { kind.at(0.0F); }) add(kind, amplitude, at.cosine, axial);
    });
  }
  add_axial(axis, at, axial, sum);
  return part;
}

}  // namespace

bool has_no_speed(const SpeedField& field, std::size_t first) {
  return is_zero(&field.speed[first]) &&
         std::ranges::all_of(field.angular, [&](const AngularSpeed& part) {
           return is_zero(&part.amplitude[first]);
         });
}

Hamiltonian hamiltonian(const SpeedField& field, std::size_t first, const RowVectors& p) {
  Hamiltonian sum;
  if (!is_zero(&field.speed[first])) add_isotropic(&field.speed[first], p, sum);
  for (std::size_t part = 0; part < field.angular.size();) {
    const auto& [factor, amplitudes] = field.angular[part];
    if (factor.axis()) {
      part = add_about_axis(field, part, first, p, sum);
      continue;
    }
    ++part;
    const float* amplitude = &amplitudes[first];
    if (is_zero(amplitude)) continue;
    factor.visit([&](const auto& kind) {
      if constexpr (requires { kind.rate(Vec3f{}); }) add_crystal(kind, amplitude, p, sum);
    });
  }
  return sum;
}

}  // namespace scarp
