#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace scarp {

// Numbers that are worked on at once, in registers that every processor of this architecture has.
// Each lane is computed by itself, so the bits are those of plain arithmetic.

using FloatLanes = float __attribute__((vector_size(16)));
using FloatMask = std::int32_t __attribute__((vector_size(16)));
using DoubleLanes = double __attribute__((vector_size(16)));
using DoubleMask = std::int64_t __attribute__((vector_size(16)));

constexpr int float_lanes = 4;
constexpr int double_lanes = 2;

/// From any place in an array.
inline FloatLanes load(const float* from) {
  FloatLanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
inline DoubleLanes load(const double* from) {
  DoubleLanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}

inline void store(float* to, FloatLanes lanes) { std::memcpy(to, &lanes, sizeof lanes); }
inline void store(double* to, DoubleLanes lanes) { std::memcpy(to, &lanes, sizeof lanes); }

inline FloatLanes all_lanes(float value) { return FloatLanes{value, value, value, value}; }
inline DoubleLanes all_lanes(double value) { return DoubleLanes{value, value}; }

// For what is written once for a number and for lanes.

template <class Number>
[[gnu::always_inline]] inline Number splat(float value) {
  return Number{} + value;
}
inline float larger(float a, float b) { return a < b ? b : a; }
inline FloatLanes larger(FloatLanes a, FloatLanes b) { return a < b ? b : a; }
inline float root(float a) { return std::sqrt(a); }
inline FloatLanes root(FloatLanes a) {
  return FloatLanes{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}

inline FloatLanes lane_min(FloatLanes a, FloatLanes b) { return a < b ? a : b; }
inline FloatLanes lane_max(FloatLanes a, FloatLanes b) { return a > b ? a : b; }
inline DoubleLanes lane_min(DoubleLanes a, DoubleLanes b) { return a < b ? a : b; }
inline DoubleLanes lane_max(DoubleLanes a, DoubleLanes b) { return a > b ? a : b; }

inline bool any(FloatMask mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }
inline bool any(DoubleMask mask) { return (mask[0] | mask[1]) != 0; }

}  // namespace scarp
