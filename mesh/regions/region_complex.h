#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/region_mesh.h"
#include "core/triangle_tree.h"
#include "mesh/regions/facet_grid.h"
#include "mesh/regions/remesh.h"
#include "mesh/regions/side_images.h"
#include "mesh/regions/size_field.h"

namespace scarp {

/// An edge at a vertex.
struct Spoke {
  std::uint32_t other = 0;
  std::uint32_t facet_count = 0;
  std::array<std::uint32_t, 2> facets{};  ///< the first two
  /// Its facets are not two of one patch: bodies meet or end there, or a side of the domain.
  bool is_feature = false;
};

/// What a vertex is part of.
enum class VertexPlace {
  patch,   ///< the inside of one interface or side
  curve,   ///< a line where patches meet
  corner,  ///< anything else
};

/// Planes of the surfaces around a vertex, where they meet nearest to it.
struct NearestEdge {
  Vec3d r;
  int planes = 0;  ///< 1 on smooth surfaces, 2 on an edge, 3 at a corner; 0 without any surface
};

/// The narrowest place of a body next to a vertex: between two of its facets that share an edge,
/// or, in a flat mesh, between two lines.
struct Wedge {
  double cosine = -1;  ///< of the angle
  /// The other corners there that are not on the edge: where the body becomes thicker.
  std::array<std::uint32_t, 2> beyond{};
};

/// A region mesh that changes step by step and stays valid: see remesh().
class RegionComplex {
 public:
  RegionComplex(const RegionMesh& mesh, std::span<const TriMesh> surfaces,
                const RemeshOptions& options);

  std::size_t vertex_count() const { return positions_.size(); }
  std::size_t facet_count() const { return facets_.size(); }
  bool has_facet(std::uint32_t f) const { return is_alive_[f]; }
  const RegionMesh::Facet& facet(std::uint32_t f) const { return facets_[f]; }
  const Vec3d& position(std::uint32_t v) const { return positions_[v]; }
  const std::vector<std::uint32_t>& star(std::uint32_t v) const { return stars_[v]; }
  std::array<Vec3d, 3> corners_of(std::uint32_t f) const;

  /// The altitude of a facet in parts of its target size, up to the part that is enough.
  double relative_altitude_of(std::uint32_t f, double enough) const {
    return relative_altitude(corners_of(f), targets_, enough);
  }

  std::vector<Spoke> spokes(std::uint32_t v) const;
  /// The most particular one of a vertex and its images.
  VertexPlace place(std::uint32_t v, const std::vector<Spoke>& spokes) const;

  /// Where the surfaces around a vertex meet, near r.
  NearestEdge nearest_edge(std::uint32_t v, const std::vector<Spoke>& spokes, const Vec3d& r) const;

  /// The worst shape of the facets around a vertex: altitude by longest edge, at most 0.87.
  double worst_shape(std::uint32_t v) const;

  /// How far the interfaces around a vertex are from their surfaces.
  double distance_around(std::uint32_t v) const;

  /// Among the edges at a vertex where bodies meet.
  Wedge narrowest_wedge(std::uint32_t v, const std::vector<Spoke>& spokes) const;

  /// Each changes something and is true, or is not allowed to and is false. What happens on a
  /// periodic side happens on the opposite one as well.
  bool collapse(std::uint32_t removed, std::uint32_t kept);
  /// The kept vertex moves, and interfaces have to become nearer to their surfaces.
  bool collapse_and_move(std::uint32_t removed, std::uint32_t kept, const Vec3d& r);
  bool flip(std::uint32_t a, std::uint32_t b);
  /// better: only if the worst shape around the vertex becomes better.
  bool move(std::uint32_t v, const Vec3d& r, bool better);

  /// The kept vertex moves, and the narrowest wedge has to become wider.
  bool widen_wedge(std::uint32_t removed, std::uint32_t kept, const Vec3d& r);

  /// How far interfaces may be from their surfaces within a spacing of detail, from now on.
  void allow_distance_at_detail(double distance) { distance_at_detail_ = distance; }

  /// How large facets become next: target sizes are not larger from now on, so that those of a mesh
  /// that is still fine are not thin for their targets.
  void limit_targets(double largest) { targets_.limit(largest); }

  RegionMesh mesh() const;

 private:
  /// To the surfaces of their layers.
  struct Fit {
    double distance = 0;
    double cosine = 1;  ///< of normals
    double total = 0;   ///< squares of distances over the area, or along lines

    void add(const Fit& other) {
      distance = std::max(distance, other.distance);
      cosine = std::min(cosine, other.cosine);
      total += other.total;
    }
  };

  struct MovedVertex {
    std::uint32_t v = 0;
    Vec3d r;
  };

  struct Change {
    std::vector<std::uint32_t> removed{};
    std::vector<RegionMesh::Facet> added{};
    std::vector<MovedVertex> moved{};
    double least_shape = 0;  ///< that it has to give
    /// Facets may become worse if interfaces become nearer to their surfaces.
    bool is_for_distance = false;
    std::vector<Fit> fits{};  ///< of the added facets, as soon as they are known
  };

  /// Of some facets.
  struct Worst {
    double altitude = 1e300;
    double relative_altitude = thin_part;
    double shape = 1;
  };
  Worst worst_of(const std::vector<std::uint32_t>& facets) const;

  VertexPlace own_place(std::uint32_t v, const std::vector<Spoke>& spokes) const;
  /// Each adds to a change what becomes of some facets, if that is possible.
  bool add_collapse(std::uint32_t removed, std::uint32_t kept, Change& change) const;
  bool add_move(std::uint32_t v, const Vec3d& r, Change& change) const;
  bool add_flip(std::uint32_t a, std::uint32_t b, Change& change) const;
  /// Of a vertex and its images, into those of another one.
  std::optional<Change> collapsed(std::uint32_t removed, std::uint32_t kept) const;
  std::optional<Change> collapsed_and_moved(std::uint32_t removed, std::uint32_t kept,
                                            const Vec3d& r) const;
  /// Where a vertex may go next to some place; nothing if it would come onto another side.
  std::optional<Vec3d> on_its_sides(std::uint32_t v, Vec3d r) const;

  const Vec3d& place_in(const Change& change, std::uint32_t v) const {
    for (const MovedVertex& moved : change.moved)
      if (moved.v == v) return moved.r;
    return positions_[v];
  }
  std::array<Vec3d, 3> corners_in(const Change& change, const RegionMesh::Facet& facet) const;
  bool same_patch(std::uint32_t f, std::uint32_t g) const;
  bool faces_right(const RegionMesh::Facet& facet, const std::array<Vec3d, 3>& corners) const;
  Fit fit_of(const RegionMesh::Facet& facet, const std::array<Vec3d, 3>& corners,
             double largest) const;
  void add_line_fit(int layer, const Vec3d& a, const Vec3d& b, Fit& fit) const;
  Fit fit_before(const Change& change) const;
  Fit fit_after(Change& change, double largest) const;
  Fit flat_fit(const std::vector<RegionMesh::Facet>& facets, const Change* change) const;
  bool fits(Change& change) const;
  double allowed_distance(const Change& change) const;
  bool has_good_shape(const Change& change) const;
  bool collides(const Change& change) const;
  bool try_change(Change& change);
  void apply(const Change& change);
  /// What is left of the change before the last.
  struct Before {
    std::vector<std::uint32_t> facets;
    std::vector<RegionMesh::Facet> removed;
    std::vector<Fit> fits;
    std::vector<MovedVertex> moved;
  };
  void take_back();
  void link(std::uint32_t f);
  void unlink(std::uint32_t f);

  RegionMesh frame_;  ///< without facets and vertices
  RemeshOptions options_;
  double distance_at_detail_ = 0;
  SizeField targets_;
  SideImages images_;
  std::vector<TriangleTree> trees_;
  std::vector<std::vector<Vec3f>> normals_;
  std::vector<Vec3d> positions_;
  std::vector<std::uint8_t> sides_;
  std::vector<RegionMesh::Facet> facets_;
  std::vector<bool> is_alive_;
  std::vector<Fit> fits_;  ///< of facets in space
  std::vector<std::vector<std::uint32_t>> stars_;
  FacetGrid grid_;
  Before before_;  ///< the last change
};

}  // namespace scarp
