#include "levelset/metrology/tet_cut.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace scarp {

namespace {

using Tet = std::array<std::uint32_t, 4>;

/// Two triangles with edges from each corner of the first to that of the second. A corner may be
/// the same in both.
struct Prism {
  std::array<std::uint32_t, 3> a{};
  std::array<std::uint32_t, 3> b{};
};

/// Quadrilaterals are cut from their first vertex, so that the prism beyond is cut alike.
void split(Prism prism, const CutVertices& vertices, std::vector<Tet>& tets) {
  const auto is_before = [&](std::uint32_t a, std::uint32_t b) { return vertices.is_before(a, b); };
  const std::uint32_t lowest = std::min(*std::ranges::min_element(prism.a, is_before),
                                        *std::ranges::min_element(prism.b, is_before), is_before);
  if (std::ranges::find(prism.a, lowest) == prism.a.end()) {
    // Turned over; volumes stay positive.
    prism = {{prism.b[0], prism.b[2], prism.b[1]}, {prism.a[0], prism.a[2], prism.a[1]}};
  }
  while (prism.a[0] != lowest) {
    std::rotate(prism.a.begin(), prism.a.begin() + 1, prism.a.end());
    std::rotate(prism.b.begin(), prism.b.begin() + 1, prism.b.end());
  }
  const auto [a1, a2, a3] = prism.a;
  const auto [b1, b2, b3] = prism.b;
  const auto add = [&](const Tet& tet) {
    for (std::size_t n = 0; n < 4; ++n)
      for (std::size_t m = 0; m < n; ++m)
        if (tet[n] == tet[m]) return;
    tets.push_back(tet);
  };
  add({a1, b1, b2, b3});
  if (is_before(std::min(a2, b3, is_before), std::min(a3, b2, is_before))) {
    add({a1, a2, a3, b3});
    add({a1, a2, b3, b2});
  } else {
    add({a1, a2, a3, b2});
    add({a1, a3, b3, b2});
  }
}

/// The same tetrahedron with another vertex first.
Tet from_vertex(const Tet& t, std::size_t n) {
  switch (n) {
    case 0:
      return t;
    case 1:
      return {t[1], t[0], t[3], t[2]};
    case 2:
      return {t[2], t[3], t[0], t[1]};
    default:
      return {t[3], t[2], t[1], t[0]};
  }
}

/// Cuts off the first vertex, which alone has its sign.
void cut_off_first(const Tet& t, int surface, CutVertices& vertices, std::vector<Tet>& first,
                   std::vector<Tet>& others) {
  Prism rest;
  for (std::size_t n = 0; n < 3; ++n) {
    rest.b[n] = t[n + 1];
    rest.a[n] = vertices.value(t[n + 1], surface) == 0 ? t[n + 1]
                                                       : vertices.between(t[0], t[n + 1], surface);
  }
  first.push_back({t[0], rest.a[0], rest.a[1], rest.a[2]});
  split(rest, vertices, others);
}

/// Cuts between the first two vertices and the last two.
void cut_in_the_middle(const Tet& t, int surface, CutVertices& vertices, std::vector<Tet>& first,
                       std::vector<Tet>& last) {
  const auto cut = [&](std::size_t n, std::size_t m) {
    return vertices.between(t[n], t[m], surface);
  };
  const std::uint32_t c02 = cut(0, 2);
  const std::uint32_t c03 = cut(0, 3);
  const std::uint32_t c12 = cut(1, 2);
  const std::uint32_t c13 = cut(1, 3);
  split({{t[0], c02, c03}, {t[1], c12, c13}}, vertices, first);
  split({{t[2], c02, c12}, {t[3], c03, c13}}, vertices, last);
}

/// Cuts by one surface.
void cut_once(const Tet& t, int surface, CutVertices& vertices, std::vector<Tet>& inside,
              std::vector<Tet>& outside) {
  std::array<int, 4> sign{};
  int negative = 0;
  int positive = 0;
  for (std::size_t n = 0; n < 4; ++n) {
    const double value = vertices.value(t[n], surface);
    sign[n] = value < 0 ? -1 : value > 0 ? 1 : 0;
    negative += sign[n] < 0 ? 1 : 0;
    positive += sign[n] > 0 ? 1 : 0;
  }
  const auto first_of = [&](int wanted) {
    return static_cast<std::size_t>(std::ranges::find(sign, wanted) - sign.begin());
  };
  if (negative == 0) {
    outside.push_back(t);
  } else if (positive == 0) {
    inside.push_back(t);
  } else if (negative == 1) {
    cut_off_first(from_vertex(t, first_of(-1)), surface, vertices, inside, outside);
  } else if (positive == 1) {
    cut_off_first(from_vertex(t, first_of(1)), surface, vertices, outside, inside);
  } else {
    Tet turned = from_vertex(t, first_of(-1));
    while (!(vertices.value(turned[1], surface) < 0))
      turned = {turned[0], turned[2], turned[3], turned[1]};
    cut_in_the_middle(turned, surface, vertices, inside, outside);
  }
}

}  // namespace

void values_between(const double* a, const double* b, double t, int surface, int count,
                    double least, double* values) {
  for (int m = 0; m < count; ++m) {
    const bool is_same = m == surface || (a[m] == a[surface] && b[m] == b[surface]);
    values[m] = is_same ? 0 : (1 - t) * a[m] + t * b[m];
    if (std::abs(values[m]) < least) values[m] = 0;
    if (m > 0) values[m] = std::min(values[m], values[m - 1]);
  }
}

CutVertices::CutVertices(int surface_count, double least)
    : surface_count_(surface_count),
      least_(least),
      cuts_(static_cast<std::size_t>(surface_count)) {}

std::uint32_t CutVertices::add(const Vec3d& r, std::uint8_t sides, const double* values) {
  const auto v = static_cast<std::uint32_t>(positions_.size());
  positions_.push_back(r);
  sides_.push_back(sides);
  values_.insert(values_.end(), values, values + surface_count_);
  return v;
}

bool CutVertices::is_before(std::uint32_t a, std::uint32_t b) const {
  const Vec3d& p = positions_[a];
  const Vec3d& q = positions_[b];
  return std::tie(p.z, p.y, p.x, a) < std::tie(q.z, q.y, q.x, b);
}

std::uint32_t CutVertices::between(std::uint32_t a, std::uint32_t b, int surface) {
  if (is_before(b, a)) std::swap(a, b);
  const std::uint64_t key = (std::uint64_t{a} << 32U) | b;
  const auto [place, is_new] =
      cuts_[static_cast<std::size_t>(surface)].try_emplace(key, static_cast<std::uint32_t>(size()));
  if (!is_new) return place->second;
  const double t = value(a, surface) / (value(a, surface) - value(b, surface));
  std::vector<double> own(static_cast<std::size_t>(surface_count_));
  values_between(values(a), values(b), t, surface, surface_count_, least_, own.data());
  const auto common = static_cast<std::uint8_t>(sides_[a] & sides_[b]);
  return add(positions_[a] + t * (positions_[b] - positions_[a]), common, own.data());
}

void cut_tet(const std::array<std::uint32_t, 4>& tet, CutVertices& vertices,
             std::vector<CutTet>& pieces) {
  std::vector<Tet> rest{tet};
  std::vector<Tet> inside;
  std::vector<Tet> outside;
  for (int surface = 0; surface < vertices.surface_count(); ++surface) {
    inside.clear();
    outside.clear();
    for (const Tet& t : rest) cut_once(t, surface, vertices, inside, outside);
    for (const Tet& t : inside) pieces.push_back({t, surface});
    std::swap(rest, outside);
  }
  for (const Tet& t : rest) pieces.push_back({t, vertices.surface_count()});
}

}  // namespace scarp
