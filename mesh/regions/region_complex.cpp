#include "mesh/regions/region_complex.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace scarp {

namespace {

constexpr std::uint32_t none = ~std::uint32_t{0};

/// Facets keep this distance from others, in spacings: programs that fill the mesh take what is
/// nearer for the same.
constexpr double facet_clearance = 0.02;

bool has(const Triangle& triangle, std::uint32_t v) {
  return triangle[0] == v || triangle[1] == v || triangle[2] == v;
}

/// Shares of the corners in the places of a facet that are compared with a surface, the first of
/// which tell most.
constexpr std::array<std::array<double, 3>, 7> facet_samples{{{1.0 / 3, 1.0 / 3, 1.0 / 3},
                                                              {0.5, 0.5, 0},
                                                              {0, 0.5, 0.5},
                                                              {0.5, 0, 0.5},
                                                              {2.0 / 3, 1.0 / 6, 1.0 / 6},
                                                              {1.0 / 6, 2.0 / 3, 1.0 / 6},
                                                              {1.0 / 6, 1.0 / 6, 2.0 / 3}}};

Vec3d sample(const std::array<Vec3d, 3>& c, const std::array<double, 3>& shares) {
  return shares[0] * c[0] + shares[1] * c[1] + shares[2] * c[2];
}

}  // namespace

RegionComplex::RegionComplex(const RegionMesh& mesh, std::span<const TriMesh> surfaces,
                             const RemeshOptions& options)
    : frame_{.is_flat = mesh.is_flat,
             .vertices = {},
             .facets = {},
             .bodies = mesh.bodies,
             .regions = mesh.regions,
             .lower = mesh.lower,
             .upper = mesh.upper,
             .is_periodic = mesh.is_periodic},
      options_(options),
      targets_(surfaces, options.spacing, options.size),
      images_(mesh),
      positions_(mesh.vertices),
      facets_(mesh.facets),
      is_alive_(mesh.facets.size(), true),
      stars_(mesh.vertices.size()),
      grid_(1.5 * options.spacing) {
  for (const TriMesh& surface : surfaces) {
    trees_.emplace_back(surface);
    normals_.push_back(facet_normals(surface));
  }
  for (const Vec3d& r : positions_) sides_.push_back(sides_at(mesh, r));
  for (std::uint32_t f = 0; f < facets_.size(); ++f) {
    link(f);
    if (!mesh.is_flat) fits_.push_back(fit_of(facets_[f], corners_of(f), 1e300));
  }
}

std::array<Vec3d, 3> RegionComplex::corners_of(std::uint32_t f) const {
  const Triangle& t = facets_[f].corners;
  return {positions_[t[0]], positions_[t[1]], positions_[t[2]]};
}

std::array<Vec3d, 3> RegionComplex::corners_in(const Change& change,
                                               const RegionMesh::Facet& facet) const {
  return {place_in(change, facet.corners[0]), place_in(change, facet.corners[1]),
          place_in(change, facet.corners[2])};
}

void RegionComplex::link(std::uint32_t f) {
  for (const std::uint32_t v : facets_[f].corners) stars_[v].push_back(f);
  if (!frame_.is_flat) grid_.add(f, corners_of(f));
}

void RegionComplex::unlink(std::uint32_t f) {
  for (const std::uint32_t v : facets_[f].corners) std::erase(stars_[v], f);
  if (!frame_.is_flat) grid_.remove(f, corners_of(f));
}

bool RegionComplex::same_patch(std::uint32_t f, std::uint32_t g) const {
  return facets_[f].bodies == facets_[g].bodies && facets_[f].side == facets_[g].side;
}

std::vector<Spoke> RegionComplex::spokes(std::uint32_t v) const {
  std::vector<Spoke> found;
  found.reserve(2 * stars_[v].size());
  for (const std::uint32_t f : stars_[v])
    for (const std::uint32_t w : facets_[f].corners)
      if (w != v) found.push_back({.other = w, .facet_count = 1, .facets = {f, none}});
  std::ranges::stable_sort(found, {}, &Spoke::other);
  std::vector<Spoke> spokes;
  for (const Spoke& spoke : found) {
    if (spokes.empty() || spokes.back().other != spoke.other) {
      spokes.push_back(spoke);
      continue;
    }
    if (spokes.back().facet_count == 1) spokes.back().facets[1] = spoke.facets[0];
    ++spokes.back().facet_count;
  }
  for (Spoke& spoke : spokes)
    spoke.is_feature = spoke.facet_count != 2 || !same_patch(spoke.facets[0], spoke.facets[1]);
  return spokes;
}

VertexPlace RegionComplex::place(std::uint32_t v, const std::vector<Spoke>& spokes) const {
  VertexPlace place = own_place(v, spokes);
  for (unsigned n = 1; n < images_.count(v); ++n) {
    const std::uint32_t image = images_.image(v, n);
    place = std::max(place, own_place(image, this->spokes(image)));
  }
  return place;
}

VertexPlace RegionComplex::own_place(std::uint32_t v, const std::vector<Spoke>& spokes) const {
  std::vector<std::uint32_t> feature_degrees;
  for (const Spoke& spoke : spokes)
    if (spoke.is_feature) feature_degrees.push_back(spoke.facet_count);
  if (feature_degrees.size() == 1 || feature_degrees.size() > 2) return VertexPlace::corner;
  // Facets that go on into each other are a sheet. A vertex is ordinary if one sheet is all around
  // it, or each goes from one feature to the other.
  const std::vector<std::uint32_t>& star = stars_[v];
  std::vector<std::uint32_t> sheet(star.size());
  for (std::uint32_t n = 0; n < star.size(); ++n) sheet[n] = n;
  std::size_t sheets = star.size();
  const auto index = [&](std::uint32_t f) {
    return static_cast<std::size_t>(std::ranges::find(star, f) - star.begin());
  };
  for (const Spoke& spoke : spokes) {
    if (spoke.is_feature) continue;
    const std::uint32_t a = sheet[index(spoke.facets[0])];
    const std::uint32_t b = sheet[index(spoke.facets[1])];
    if (a == b) continue;
    std::ranges::replace(sheet, b, a);
    --sheets;
  }
  if (feature_degrees.empty()) return sheets == 1 ? VertexPlace::patch : VertexPlace::corner;
  return feature_degrees[0] == sheets && feature_degrees[1] == sheets ? VertexPlace::curve
                                                                      : VertexPlace::corner;
}

double RegionComplex::worst_shape(std::uint32_t v) const {
  double worst = 1;
  for (const std::uint32_t f : stars_[v]) worst = std::min(worst, shape_of(corners_of(f)));
  return worst;
}

bool RegionComplex::faces_right(const RegionMesh::Facet& facet,
                                const std::array<Vec3d, 3>& corners) const {
  const Vec3d n = cross(corners[1] - corners[0], corners[2] - corners[0]);
  if (frame_.is_flat) return n.y < 0;
  if (facet.side == RegionMesh::nothing) return true;
  return facet.side % 2 == 0 ? n[facet.side / 2] < 0 : n[facet.side / 2] > 0;
}

/// Gives up where the distance is more than largest.
RegionComplex::Fit RegionComplex::fit_of(const RegionMesh::Facet& facet,
                                         const std::array<Vec3d, 3>& corners,
                                         double largest) const {
  Fit fit;
  if (facet.layer == RegionMesh::nothing) return fit;
  const auto layer = static_cast<std::size_t>(facet.layer);
  if (trees_[layer].empty()) return fit;
  const Vec3d area = cross(corners[1] - corners[0], corners[2] - corners[0]);
  const Vec3d n = normalized(area);
  const double farthest = 4 * options_.spacing;
  double cosine = 0;
  double squares = 0;
  int count = 0;
  const auto compare = [&](const Vec3d& r) {
    const ClosestPoint closest = trees_[layer].closest(r, farthest);
    const double distance = closest.found() ? closest.distance : farthest;
    fit.distance = std::max(fit.distance, distance);
    squares += distance * distance;
    if (closest.found()) cosine += dot(n, Vec3d(normals_[layer][closest.triangle]));
    ++count;
    return fit.distance <= largest;
  };
  for (std::size_t s = 0; s < 4; ++s)
    if (!compare(sample(corners, facet_samples[s]))) return fit;
  // Of facets larger than cells of the grid more.
  const double longest = std::max({length(corners[1] - corners[0]), length(corners[2] - corners[1]),
                                   length(corners[0] - corners[2])});
  const int parts = static_cast<int>(std::ceil(longest / (1.5 * options_.spacing)));
  for (int a = 0; parts > 1 && a <= parts; ++a) {
    for (int b = 0; a + b <= parts; ++b) {
      const double u = static_cast<double>(a) / parts;
      const double w = static_cast<double>(b) / parts;
      if (!compare(sample(corners, {u, w, 1 - u - w}))) return fit;
    }
  }
  fit.cosine = cosine / count;
  fit.total = length(area) * squares / count;
  return fit;
}

void RegionComplex::add_line_fit(int layer, const Vec3d& a, const Vec3d& b, Fit& fit) const {
  const int parts = 2 * std::max(2, static_cast<int>(std::ceil(length(b - a) / options_.spacing)));
  for (int n = 0; n <= parts; ++n) {
    const double t = static_cast<double>(n) / parts;
    const ClosestPoint closest =
        trees_[static_cast<std::size_t>(layer)].closest((1 - t) * a + t * b);
    if (!closest.found()) continue;
    fit.distance = std::max(fit.distance, closest.distance);
    fit.total += length(b - a) * closest.distance * closest.distance / parts;
  }
}

/// Of the lines of a flat mesh at some facets: those of the change, or those that are there.
RegionComplex::Fit RegionComplex::flat_fit(const std::vector<RegionMesh::Facet>& facets,
                                           const Change* change) const {
  Fit fit;
  for (const RegionMesh::Facet& facet : facets) {
    for (std::size_t n = 0; n < 3; ++n) {
      const std::uint32_t a = facet.corners[n];
      const std::uint32_t b = facet.corners[(n + 1) % 3];
      const auto is_beyond = [&](const RegionMesh::Facet& other) {
        return has(other.corners, a) && has(other.corners, b) && other.bodies[0] != facet.bodies[0];
      };
      const RegionMesh::Facet* beyond = nullptr;
      for (const std::uint32_t f : stars_[a]) {
        if (change != nullptr && std::ranges::find(change->removed, f) != change->removed.end())
          continue;
        if (is_beyond(facets_[f])) beyond = &facets_[f];
      }
      for (const RegionMesh::Facet& other : facets)
        if (is_beyond(other)) beyond = &other;
      if (beyond == nullptr) continue;
      const Vec3d& from = change != nullptr ? place_in(*change, a) : positions_[a];
      const Vec3d& to = change != nullptr ? place_in(*change, b) : positions_[b];
      add_line_fit(std::min(facet.layer, beyond->layer), from, to, fit);
    }
  }
  return fit;
}

RegionComplex::Fit RegionComplex::fit_before(const Change& change) const {
  if (frame_.is_flat) {
    std::vector<RegionMesh::Facet> facets;
    for (const std::uint32_t f : change.removed) facets.push_back(facets_[f]);
    return flat_fit(facets, nullptr);
  }
  Fit fit;
  for (const std::uint32_t f : change.removed) fit.add(fits_[f]);
  return fit;
}

/// Gives up where the distance is more than largest.
RegionComplex::Fit RegionComplex::fit_after(Change& change, double largest) const {
  if (frame_.is_flat) return flat_fit(change.added, &change);
  Fit fit;
  change.fits.clear();
  for (const RegionMesh::Facet& facet : change.added) {
    change.fits.push_back(fit_of(facet, corners_in(change, facet), largest));
    fit.add(change.fits.back());
    if (fit.distance > largest) break;
  }
  return fit;
}

double RegionComplex::allowed_distance(const Change& change) const {
  if (distance_at_detail_ <= options_.max_distance) return options_.max_distance;
  const double plain = (1 + SizeField::growth) * options_.spacing;
  for (const RegionMesh::Facet& facet : change.added)
    for (const Vec3d& r : corners_in(change, facet))
      if (targets_.at(r) >= plain) return options_.max_distance;
  return distance_at_detail_;
}

bool RegionComplex::fits(Change& change) const {
  const double least_cosine = change.is_for_distance ? 0 : 0.5;
  constexpr double nearer = 0.98;
  const Fit before = fit_before(change);
  const double allowed = allowed_distance(change);
  const double largest = std::max(before.distance, allowed);
  const Fit after = fit_after(change, largest);
  return after.distance <= largest &&
         (after.cosine >= least_cosine || after.cosine >= before.cosine) &&
         // What is too far away does not spread.
         (after.distance <= allowed || after.total <= before.total) &&
         (!change.is_for_distance || after.total < nearer * before.total);
}

RegionComplex::Worst RegionComplex::worst_of(const std::vector<std::uint32_t>& facets) const {
  Worst worst;
  for (const std::uint32_t f : facets) {
    const std::array<Vec3d, 3> c = corners_of(f);
    worst.altitude = std::min(worst.altitude, least_altitude(c));
    worst.relative_altitude =
        std::min(worst.relative_altitude, relative_altitude(c, targets_, thin_part));
    worst.shape = std::min(worst.shape, shape_of(c));
  }
  return worst;
}

bool RegionComplex::has_good_shape(const Change& change) const {
  constexpr double good_altitude = 0.2;  // spacings
  constexpr double good_shape = 0.15;
  constexpr double least_altitude_for_distance = 0.1;
  const Worst before = worst_of(change.removed);
  const double h = options_.spacing;
  double altitude = std::min(good_altitude * h, before.altitude);
  double shape = std::min(good_shape, before.shape);
  if (change.is_for_distance) {
    altitude = std::min(least_altitude_for_distance * h, before.altitude);
    shape = 0;
  }
  shape = std::max(shape, change.least_shape);
  return std::ranges::all_of(change.added, [&](const RegionMesh::Facet& facet) {
    const std::array<Vec3d, 3> c = corners_in(change, facet);
    return faces_right(facet, c) && least_altitude(c) >= altitude && least_altitude(c) > 0 &&
           shape_of(c) >= shape &&
           relative_altitude(c, targets_, thin_part) >= before.relative_altitude;
  });
}

bool RegionComplex::collides(const Change& change) const {
  if (frame_.is_flat) return false;
  const double clearance = facet_clearance * options_.spacing;
  std::vector<PlacedTriangle> added;
  for (const RegionMesh::Facet& facet : change.added)
    added.push_back({facet.corners, corners_in(change, facet)});
  std::vector<std::uint32_t> near;
  for (std::size_t n = 0; n < added.size(); ++n) {
    for (std::size_t m = 0; m < n; ++m)
      if (collide(added[n], added[m], clearance)) return true;
    Box box;
    for (const Vec3d& r : added[n].r) {
      box.add(r - Vec3d{clearance, clearance, clearance});
      box.add(r + Vec3d{clearance, clearance, clearance});
    }
    grid_.near(box, near);
    for (const std::uint32_t f : near) {
      if (std::ranges::find(change.removed, f) != change.removed.end()) continue;
      const PlacedTriangle other{facets_[f].corners, corners_of(f)};
      bool meets = true;
      for (int axis = 0; axis < 3 && meets; ++axis) {
        const auto [low, high] =
            std::minmax({other.r[0][axis], other.r[1][axis], other.r[2][axis]});
        meets = low <= box.upper[axis] && high >= box.lower[axis];
      }
      if (meets && collide(added[n], other, clearance)) return true;
    }
  }
  return false;
}

bool RegionComplex::try_change(Change& change) {
  if (!has_good_shape(change) || !fits(change) || collides(change)) return false;
  apply(change);
  return true;
}

void RegionComplex::apply(const Change& change) {
  before_ = {};
  before_.facets = change.removed;
  for (const std::uint32_t f : change.removed) {
    before_.removed.push_back(facets_[f]);
    if (!frame_.is_flat) before_.fits.push_back(fits_[f]);
    unlink(f);
    is_alive_[f] = false;
  }
  for (const auto& [v, r] : change.moved) {
    before_.moved.push_back({v, positions_[v]});
    positions_[v] = r;
  }
  for (std::size_t n = 0; n < change.added.size(); ++n) {
    const std::uint32_t f = change.removed[n];
    facets_[f] = change.added[n];
    if (!frame_.is_flat) fits_[f] = change.fits[n];
    is_alive_[f] = true;
    link(f);
  }
}

void RegionComplex::take_back() {
  for (const std::uint32_t f : before_.facets)
    if (is_alive_[f]) unlink(f);
  for (const auto& [v, r] : before_.moved) positions_[v] = r;
  for (std::size_t n = 0; n < before_.facets.size(); ++n) {
    const std::uint32_t f = before_.facets[n];
    facets_[f] = before_.removed[n];
    if (!frame_.is_flat) fits_[f] = before_.fits[n];
    is_alive_[f] = true;
    link(f);
  }
}

bool RegionComplex::add_collapse(std::uint32_t removed, std::uint32_t kept, Change& change) const {
  if (kept == none || (sides_[removed] & ~sides_[kept]) != 0) return false;
  const std::vector<Spoke> around = spokes(removed);
  const VertexPlace where = own_place(removed, around);
  if (where == VertexPlace::corner) return false;
  const auto edge = std::ranges::find(around, kept, &Spoke::other);
  if (edge == around.end() || (where == VertexPlace::curve && !edge->is_feature)) return false;
  // What both are next to may only be the facets between them.
  const std::vector<Spoke> beyond = spokes(kept);
  std::vector<std::uint32_t> common;
  for (const Spoke& spoke : around) {
    const auto other = std::ranges::lower_bound(beyond, spoke.other, {}, &Spoke::other);
    if (other == beyond.end() || other->other != spoke.other) continue;
    if (where == VertexPlace::curve && spoke.is_feature && other->is_feature) return false;
    common.push_back(spoke.other);
  }
  if (common.size() != edge->facet_count) return false;
  for (const std::uint32_t f : stars_[removed]) {
    if (std::ranges::find(change.removed, f) != change.removed.end()) return false;
    change.removed.push_back(f);
    RegionMesh::Facet facet = facets_[f];
    if (has(facet.corners, kept)) continue;
    int of_common = 0;
    for (std::uint32_t& v : facet.corners) {
      of_common += std::ranges::find(common, v) != common.end() ? 1 : 0;
      if (v == removed) v = kept;
    }
    if (of_common == 2) return false;
    change.added.push_back(facet);
  }
  return true;
}

bool RegionComplex::add_move(std::uint32_t v, const Vec3d& r, Change& change) const {
  for (unsigned n = 0; n < images_.count(v); ++n) {
    const std::uint32_t image = images_.image(v, n);
    const auto target = on_its_sides(image, r);
    if (!target) return false;
    change.moved.push_back({image, *target});
    for (const std::uint32_t f : stars_[image]) {
      if (std::ranges::find(change.removed, f) != change.removed.end()) continue;
      change.removed.push_back(f);
      change.added.push_back(facets_[f]);
    }
  }
  return true;
}

std::optional<RegionComplex::Change> RegionComplex::collapsed(std::uint32_t removed,
                                                              std::uint32_t kept) const {
  Change change;
  for (unsigned n = 0; n < images_.count(removed); ++n)
    if (!add_collapse(images_.image(removed, n), images_.image_along(removed, n, kept), change))
      return std::nullopt;
  return change;
}

std::optional<RegionComplex::Change> RegionComplex::collapsed_and_moved(std::uint32_t removed,
                                                                        std::uint32_t kept,
                                                                        const Vec3d& r) const {
  auto change = collapsed(removed, kept);
  if (!change || !add_move(kept, r, *change)) return std::nullopt;
  return change;
}

bool RegionComplex::collapse(std::uint32_t removed, std::uint32_t kept) {
  auto change = collapsed(removed, kept);
  return change && try_change(*change);
}

bool RegionComplex::collapse_and_move(std::uint32_t removed, std::uint32_t kept, const Vec3d& r) {
  auto change = collapsed_and_moved(removed, kept, r);
  if (!change) return false;
  change->is_for_distance = true;
  return try_change(*change);
}

Wedge RegionComplex::narrowest_wedge(std::uint32_t v, const std::vector<Spoke>& spokes) const {
  Wedge narrowest;
  const auto compare = [&](const Vec3d& a, const Vec3d& b, std::uint32_t p, std::uint32_t q) {
    const double cosine = dot(normalized(a), normalized(b));
    if (cosine > narrowest.cosine) narrowest = {.cosine = cosine, .beyond = {p, q}};
  };
  const Vec3d& r = positions_[v];
  for (std::size_t n = 0; n < spokes.size(); ++n) {
    if (!spokes[n].is_feature) continue;
    const Vec3d along = positions_[spokes[n].other] - r;
    if (frame_.is_flat) {
      for (std::size_t m = 0; m < n; ++m)
        if (spokes[m].is_feature)
          compare(along, positions_[spokes[m].other] - r, spokes[n].other, spokes[m].other);
      continue;
    }
    std::vector<std::uint32_t> apexes;
    for (const std::uint32_t f : stars_[v])
      if (has(facets_[f].corners, spokes[n].other))
        for (const std::uint32_t w : facets_[f].corners)
          if (w != v && w != spokes[n].other) apexes.push_back(w);
    const auto across = [&](std::uint32_t w) {
      const Vec3d d = positions_[w] - r;
      return d - dot(d, along) / dot(along, along) * along;
    };
    for (std::size_t i = 0; i < apexes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        compare(across(apexes[i]), across(apexes[j]), apexes[i], apexes[j]);
  }
  return narrowest;
}

bool RegionComplex::widen_wedge(std::uint32_t removed, std::uint32_t kept, const Vec3d& r) {
  auto change = collapsed_and_moved(removed, kept, r);
  if (!change) return false;
  const double before = narrowest_wedge(kept, spokes(kept)).cosine;
  if (!try_change(*change)) return false;
  constexpr double wider = 0.02;  // of the cosine
  if (narrowest_wedge(kept, spokes(kept)).cosine < before - wider) return true;
  take_back();
  return false;
}

bool RegionComplex::add_flip(std::uint32_t a, std::uint32_t b, Change& change) const {
  const std::vector<Spoke> around = spokes(a);
  const auto edge = std::ranges::find(around, b, &Spoke::other);
  if (edge == around.end() || edge->is_feature) return false;
  const auto apex = [&](std::uint32_t f) {
    for (const std::uint32_t v : facets_[f].corners)
      if (v != a && v != b) return v;
    return none;
  };
  auto [f, g] = edge->facets;
  const Triangle& t = facets_[f].corners;
  const auto n = static_cast<std::size_t>(std::ranges::find(t, a) - t.begin());
  if (t[(n + 1) % 3] != b) std::swap(f, g);
  const std::uint32_t c = apex(f);
  const std::uint32_t d = apex(g);
  for (const std::uint32_t other : stars_[c])
    if (has(facets_[other].corners, d)) return false;
  RegionMesh::Facet first = facets_[f];
  RegionMesh::Facet second = facets_[g];
  first.corners = {a, d, c};
  second.corners = {d, b, c};
  change.removed.insert(change.removed.end(), {f, g});
  change.added.insert(change.added.end(), {first, second});
  return true;
}

bool RegionComplex::flip(std::uint32_t a, std::uint32_t b) {
  Change change;
  if (!add_flip(a, b, change)) return false;
  const RegionMesh::Facet facet = facets_[change.removed.front()];
  const std::uint32_t image = images_.opposite(a, facet.side);
  if (image != none && !add_flip(image, images_.opposite(b, facet.side), change)) return false;
  constexpr double better = 1.05;
  change.least_shape = better * worst_of(change.removed).shape;
  if (try_change(change)) return true;
  if (frame_.is_flat || facet.layer == RegionMesh::nothing) return false;
  change.least_shape = 0;
  change.is_for_distance = true;
  if (fit_before(change).distance <= 0.5 * options_.max_distance) return false;
  return try_change(change);
}

std::optional<Vec3d> RegionComplex::on_its_sides(std::uint32_t v, Vec3d r) const {
  for (int side = 0; side < RegionMesh::side_count; ++side) {
    if ((sides_[v] >> static_cast<unsigned>(side) & 1U) == 0) continue;
    const auto axis = static_cast<std::size_t>(side / 2);
    r[side / 2] = side % 2 == 0 ? frame_.lower[axis] : frame_.upper[axis];
  }
  if (frame_.is_flat) r.y = positions_[v].y;
  if ((sides_at(frame_, r) & ~sides_[v]) != 0) return std::nullopt;
  return r;
}

bool RegionComplex::move(std::uint32_t v, const Vec3d& r, bool better) {
  Change change;
  if (!add_move(v, r, change)) return false;
  if (better) {
    constexpr double margin = 1.02;
    change.least_shape = margin * worst_of(change.removed).shape;
  } else {
    change.is_for_distance = true;
  }
  return try_change(change);
}

double RegionComplex::distance_around(std::uint32_t v) const {
  return fit_before({.removed = stars_[v]}).distance;
}

NearestEdge RegionComplex::nearest_edge(std::uint32_t v, const std::vector<Spoke>& spokes,
                                        const Vec3d& r) const {
  // Planes n (x - q) = 0, by their weights, in the directions in which the vertex may move.
  std::array<bool, 3> is_fixed{(sides_[v] & 0x03U) != 0, (sides_[v] & 0x0cU) != 0 || frame_.is_flat,
                               (sides_[v] & 0x30U) != 0};
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double weight = 0;
  const auto add = [&](int layer, const Vec3d& at, double w) {
    const auto k = static_cast<std::size_t>(layer);
    const ClosestPoint closest = trees_[k].closest(at);
    if (!closest.found()) return;
    const Vec3d n(normals_[k][closest.triangle]);
    Eigen::Vector3d row{n.x, n.y, n.z};
    for (int axis = 0; axis < 3; ++axis)
      if (is_fixed[static_cast<std::size_t>(axis)]) row[axis] = 0;
    A += w * row * row.transpose();
    b += w * dot(n, closest.point - r) * row;
    weight += w;
  };
  if (frame_.is_flat) {
    for (const Spoke& spoke : spokes) {
      if (spoke.facet_count != 2 || !spoke.is_feature) continue;
      const int layer = std::min(facets_[spoke.facets[0]].layer, facets_[spoke.facets[1]].layer);
      const Vec3d along = positions_[spoke.other] - positions_[v];
      for (const double t : {0.25, 0.5, 0.75, 1.0})
        add(layer, positions_[v] + t * along, length(along));
    }
  } else {
    for (const std::uint32_t f : stars_[v]) {
      if (facets_[f].layer == RegionMesh::nothing) continue;
      const std::array<Vec3d, 3> c = corners_of(f);
      const double area = length(cross(c[1] - c[0], c[2] - c[0]));
      for (std::size_t s = 4; s < 7; ++s) add(facets_[f].layer, sample(c, facet_samples[s]), area);
    }
  }
  if (!(weight > 0)) return {.r = r};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A / weight);
  constexpr double another_plane = 0.05;  // two faces at 25 degrees, half each
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  NearestEdge nearest{.r = r};
  for (int n = 0; n < 3; ++n) {
    const double value = eigen.eigenvalues()[n];
    if (value < another_plane) continue;
    const Eigen::Vector3d u = eigen.eigenvectors().col(n);
    step += u.dot(b / weight) / value * u;
    ++nearest.planes;
  }
  nearest.r += Vec3d{step[0], step[1], step[2]};
  return nearest;
}

RegionMesh RegionComplex::mesh() const {
  RegionMesh mesh = frame_;
  std::vector<std::uint32_t> number(positions_.size(), none);
  for (std::uint32_t f = 0; f < facets_.size(); ++f) {
    if (!is_alive_[f]) continue;
    RegionMesh::Facet facet = facets_[f];
    for (std::uint32_t& v : facet.corners) {
      if (number[v] == none) {
        number[v] = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(positions_[v]);
      }
      v = number[v];
    }
    mesh.facets.push_back(facet);
  }
  return mesh;
}

}  // namespace scarp
