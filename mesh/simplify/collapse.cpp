#include "mesh/simplify/collapse.h"

#include <cmath>

#include "mesh/simplify/collapse_limits.h"

namespace scarp {

namespace {

using namespace collapse_limits;

double squared_longest_edge(Vec3d a, Vec3d b, Vec3d c) {
  return std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)});
}

/// Distance from r to the segment between a and b.
double distance_to_segment(Vec3d r, Vec3d a, Vec3d b) {
  const Vec3d ab = b - a;
  const double square = dot(ab, ab);
  const double t = square > 0 ? std::clamp(dot(r - a, ab) / square, 0.0, 1.0) : 0;
  return length(r - (a + t * ab));
}

}  // namespace

CollapseChecks::CollapseChecks(const CollapseMesh& mesh, ErrorLimit max_error, double border_error)
    : bound_(mesh.normals.size(), max_error),
      own_border_shift_(mesh.materials.empty() ? 0 : mesh.r.size(), 0),
      border_shift_(own_border_shift_),
      border_error_(border_error) {}

CollapseChecks CollapseChecks::sharing() {
  CollapseChecks checks;
  checks.border_shift_ = border_shift_;
  checks.border_error_ = border_error_;
  checks.bound_ = bound_.sharing();
  return checks;
}

bool CollapseChecks::gather(const CollapseMesh& mesh, std::uint32_t h, Vec3d r) {
  if (!star_.gather(mesh.topology, h) || star_.count == 0) return false;
  place_at(mesh, r);
  return true;
}

void CollapseChecks::place_at(const CollapseMesh& mesh, Vec3d r) {
  place_ = r;
  fan_is_spread_ = false;
  Vec3d x = mesh.r[star_.ring[0]] - r;
  for (int i = 0; i < star_.count; ++i) {
    const Vec3d y = mesh.r[star_.ring[i + 1]] - r;
    normals_[i] = cross(x, y);
    x = y;
  }
}

bool CollapseChecks::keeps_surface(const CollapseMesh& mesh, std::uint32_t h) {
  return mesh.topology.can_collapse(h) && keeps_off_sides(mesh, star_) && keeps_facets(mesh) &&
         makes_no_fold(mesh) && keeps_border(mesh, h);
}

bool CollapseChecks::keeps_facets(const CollapseMesh& mesh) const {
  const Vec3d r = place_;
  if (!mesh.is_within_sides(r)) return false;
  const bool is_noisy = mesh.thin_facets == ThinFacets::noisy;
  const double least_share = is_noisy ? 1 : as_thin * as_thin;
  Vec3d around;
  for (int i = 0; i < star_.count; ++i) around += mesh.normals[star_.facet[i]];
  for (int i = 0; i < star_.count; ++i) {
    const Vec3d x = mesh.r[star_.ring[i]];
    const Vec3d y = mesh.r[star_.ring[i + 1]];
    const Vec3d corner = mesh.r[star_.at_target[i] ? star_.v : star_.u];
    const Vec3d old_n = mesh.normals[star_.facet[i]];
    const Vec3d n = normals_[i];
    const double square = dot(n, n);
    const double longest = squared_longest_edge(r, x, y);
    const double old_longest = squared_longest_edge(corner, x, y);
    // Squares of the measure of shape, without dividing.
    const double scale = longest * longest;
    const double old_scale = old_longest * old_longest;
    const double old_square = dot(old_n, old_n);
    if (!(square > without_area * without_area * scale)) return false;
    if (square < too_thin * too_thin * scale &&
        square * old_scale < least_share * old_square * scale) {
      return false;
    }
    const bool was_needle = !(old_square > needle * needle * old_scale);
    if (was_needle ? is_noisy && !agree(n, around, lowest_cosine_of_needle)
                   : !agree(n, old_n, lowest_cosine)) {
      return false;
    }
    const bool is_sliver = is_noisy && square < sliver * sliver * scale;
    if (is_sliver && !agree(n, around, lowest_cosine_of_sliver)) return false;
    const Vec3d input_n(mesh.input_normals[star_.facet[i]]);
    if (!agree(n, input_n, lowest_cosine_in_all) &&
        !(agree(n, input_n, lowest_cosine_of_chamfer) && is_chamfer(mesh, n))) {
      return false;
    }
  }
  return true;
}

bool CollapseChecks::is_chamfer(const CollapseMesh& mesh, Vec3d n) const {
  return std::all_of(star_.facet.begin(), star_.facet.begin() + star_.count, [&](std::uint32_t f) {
    return agree(n, Vec3d(mesh.input_normals[f]), lowest_cosine_around_chamfer);
  });
}

bool CollapseChecks::turns_little(std::span<const Vec3d> reference) const {
  for (int i = 0; i < star_.count; ++i) {
    if (!agree(normals_[i], reference[star_.facet[i]], lowest_cosine_of_move)) return false;
  }
  return true;
}

bool CollapseChecks::makes_no_fold(const CollapseMesh& mesh) const {
  for (int i = 0; i < star_.count; ++i) {
    const Vec3d old_n = mesh.normals[star_.facet[i]];
    const std::uint32_t across = mesh.topology.opposite(star_.rim[i]);
    if (across != HalfEdges::none) {
      const Vec3d outer = mesh.normals[HalfEdges::facet(across)];
      if (folds(normals_[i], outer, old_n, outer)) return false;
    }
    if (i + 1 == star_.count && !star_.closed) break;
    const int after = i + 1 == star_.count ? 0 : i + 1;
    if (folds(normals_[i], normals_[after], old_n, mesh.normals[star_.facet[after]])) return false;
  }
  return true;
}

void CollapseChecks::gather_flip(const CollapseMesh& mesh, std::uint32_t h) {
  star_.gather_flip(mesh.topology, h);
  place_at(mesh, mesh.r[star_.u]);
}

bool CollapseChecks::may_flip(const CollapseMesh& mesh, std::uint32_t h,
                              std::span<const Vec3d> reference) const {
  const std::array<std::uint32_t, 2> facets{star_.facet[0], star_.facet[1]};
  const std::array<Vec3d, 2> old_n{mesh.normals[facets[0]], mesh.normals[facets[1]]};
  for (int i = 0; i < 2; ++i) {
    const Vec3d x = mesh.r[star_.ring[i]];
    const Vec3d y = mesh.r[star_.ring[i + 1]];
    const Vec3d n = normals_[i];
    const double longest = squared_longest_edge(place_, x, y);
    if (!(dot(n, n) > too_thin * too_thin * longest * longest)) return false;
    for (const std::uint32_t f : facets) {
      if (!agree(n, reference[f], lowest_cosine_of_move)) return false;
      if (!agree(n, Vec3d(mesh.input_normals[f]), lowest_cosine_in_all)) return false;
    }
  }
  // The two of them turn too little for a fold between them.
  const auto folds_outwards = [&](std::uint32_t g, int now, int before) {
    const std::uint32_t across = mesh.topology.opposite(g);
    if (across == HalfEdges::none) return false;
    const Vec3d outer = mesh.normals[HalfEdges::facet(across)];
    return folds(normals_[now], outer, old_n[before], outer);
  };
  return !folds_outwards(star_.rim[0], 0, 1) && !folds_outwards(star_.rim[1], 1, 1) &&
         !folds_outwards(HalfEdges::next(h), 1, 0) && !folds_outwards(HalfEdges::previous(h), 0, 0);
}

bool CollapseChecks::keeps_border(const CollapseMesh& mesh, std::uint32_t h) {
  new_border_shift_ = 0;
  if (mesh.materials.empty() || !mesh.is_border(h)) return true;
  // The end that goes away, and the next vertex of the border beyond it.
  const bool target_goes = place_ == mesh.r[star_.u];
  const std::uint32_t gone = target_goes ? star_.v : star_.u;
  const std::uint32_t stays = target_goes ? star_.u : star_.v;
  std::uint32_t beyond = stays;
  mesh.topology.for_each_outgoing(gone, [&](std::uint32_t g) {
    const std::uint32_t w = mesh.topology.target(g);
    if (mesh.is_border(g) && w != stays) beyond = w;
  });
  new_border_shift_ = std::max({border_shift_[gone], border_shift_[stays], border_shift_[beyond]}) +
                      distance_to_segment(mesh.r[gone], mesh.r[stays], mesh.r[beyond]);
  return new_border_shift_ <= border_error_;
}

bool CollapseChecks::keeps_bound(const CollapseMesh& mesh, const Star& star, Vec3d r) {
  if (bound_.allows(mesh, star, r)) return true;
  // A higher bound would not move what is kept.
  if (!bound_.keeps(star)) bound_was_met_ = true;
  return false;
}

void CollapseChecks::accept(const CollapseMesh& mesh, std::uint32_t h) {
  if (!mesh.materials.empty() && mesh.is_border(h)) border_shift_[star_.u] = new_border_shift_;
  bound_.accept(star_);
}

bool CollapseChecks::raise_bound() {
  if (!bound_was_met_ || !bound_.raise()) return false;
  bound_was_met_ = false;
  return true;
}

double CollapseChecks::proven_error(const HalfEdges& topology) const {
  return bound_.largest(topology);
}

}  // namespace scarp
