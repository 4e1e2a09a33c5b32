#include "apps/run/common_openings.h"

#include <algorithm>
#include <cmath>

namespace scarp {

namespace {

/// From one middle to the other. Units: nm.
std::array<double, 2> apart(const OpeningPlace& a, const OpeningPlace& b, const Frame& frame) {
  std::array<double, 2> difference{};
  for (int axis = 0; axis < 2; ++axis)
    difference[axis] = copy_near(frame, axis, b.centre[axis], a.centre[axis]) - a.centre[axis];
  return difference;
}

}  // namespace

OpeningPlace place_of(const OpeningMetrology& opening) {
  return {.number = opening.opening,
          .is_trench = opening.is_trench,
          .centre = opening.centre,
          .width = opening.width};
}

bool overlap(const OpeningPlace& a, const OpeningPlace& b, const Frame& frame) {
  const std::array<double, 2> between = apart(a, b, frame);
  for (std::size_t axis = 0; axis < 2; ++axis)
    if (std::abs(between[axis]) > 0.5 * std::max(a.width[axis], b.width[axis])) return false;
  return true;
}

bool are_at_one_place(const OpeningPlace& a, const OpeningPlace& b, const Frame& frame) {
  const std::array<double, 2> between = apart(a, b, frame);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double width = std::min(a.width[axis], b.width[axis]);
    if (std::abs(between[axis]) > std::max(0.25 * width, 2 * frame.spacing)) return false;
  }
  return a.is_trench == b.is_trench;
}

// The nearest one that the run has not seen; of those that are as near the one of the same number.
int CommonOpenings::number_of(const OpeningMetrology& opening, const std::map<int, int>& taken,
                              const Frame& frame) {
  const OpeningPlace own = place_of(opening);
  const auto is_taken = [&](int number) {
    return std::ranges::any_of(taken, [&](const auto& each) { return each.second == number; });
  };
  const auto away = [&](const OpeningPlace& other) {
    const std::array<double, 2> between = apart(own, other, frame);
    return std::pair(std::round(std::hypot(between[0], between[1]) / frame.spacing),
                     other.number == own.number ? 0 : 1);
  };
  const OpeningPlace* nearest = nullptr;
  for (const OpeningPlace& each : known_) {
    if (is_taken(each.number) || !are_at_one_place(own, each, frame)) continue;
    if (nearest == nullptr || away(each) < away(*nearest)) nearest = &each;
  }
  if (nearest != nullptr) return nearest->number;
  known_.push_back(own);
  const auto is_known = [&](int number) {
    return std::ranges::count(known_, number, &OpeningPlace::number) > 1 || is_taken(number);
  };
  while (is_known(known_.back().number)) ++known_.back().number;
  return known_.back().number;
}

void CommonOpenings::rename(std::vector<OpeningMetrology>& openings, std::map<int, int>& taken,
                            const Frame& frame) {
  for (OpeningMetrology& each : openings) {
    const auto known = taken.find(each.opening);
    const int number = known != taken.end() ? known->second : number_of(each, taken, frame);
    taken[each.opening] = number;
    each.opening = number;
  }
}

}  // namespace scarp
