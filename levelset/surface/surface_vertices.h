#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/vec3.h"
#include "levelset/grid/layers.h"
#include "levelset/grid/stencil.h"
#include "levelset/surface/cell_words.h"
#include "levelset/surface/connectivity.h"
#include "levelset/surface/crease.h"

namespace scarp {

/// Leaves that are extracted together, by one thread, into one part of the mesh.
inline constexpr std::size_t leaves_per_part = 16;

/// The vertices that belong to the nodes of a leaf: on the edges along the axes x, y, z that start
/// at a node (kinds 0..2), and on the faces normal to them (kinds 3..5). They are numbered node by
/// node, at a node by kind.
struct LeafVertices {
  static constexpr int kind_count = 6;

  std::array<LeafMask, kind_count> at;
  std::array<std::uint32_t, leaf_edge> first;  ///< number of the first one of a word
  bool any;
  bool has_faces;

  /// Kinds of which there may be vertices.
  int kinds_used() const { return has_faces ? kind_count : 3; }

  /// Nodes of a word at which there are vertices.
  std::uint64_t nodes(int i) const {
    const std::uint64_t on_edges = at[0][i] | at[1][i] | at[2][i];
    return has_faces ? on_edges | at[3][i] | at[4][i] | at[5][i] : on_edges;
  }

  /// The number of a vertex, counted as first.
  std::uint32_t number(int kind, int i, int bit) const {
    std::uint32_t result = first[i];
    for (int other = 0; other < kinds_used(); ++other) {
      // The vertex's own node counts for the kinds before its own.
      const std::uint64_t before = (std::uint64_t{other < kind ? 2U : 1U} << bit) - 1;
      result += static_cast<std::uint32_t>(std::popcount(at[other][i] & before));
    }
    return result;
  }
};

/// Where the surface cuts edges of the grid, and where its creases cross faces.
class SurfaceVertices {
 public:
  /// Without gas also where closed voids lie, without layers no exposed(). above: of a layer that
  /// is not the top one, the top's band.
  SurfaceVertices(const Band& band, const OpenGas* gas, const Layers* layers, const Band* above);

  /// Whose phi tells where the surface cuts the edge from a node to the next along an axis. It is
  /// the top's where a layer is open to the gas and another one covers it beyond the edge: the
  /// layer's own at the node between knows the nearer of its two surfaces only.
  const Band& band_of_edge(Node node, int axis) const;

  /// Nodes of every leaf that do not lie in the gas that is asked for.
  const std::vector<LeafMask>& solid() const { return solid_; }

  const LeafVertices& of_leaf(std::size_t n) const { return leaves_[n]; }

  /// The number of the first vertex of a part; numbers in a leaf count from there.
  std::uint32_t first_of_part(std::size_t part) const { return parts_[part].first; }
  std::uint32_t count() const { return count_; }

  /// Appends the positions in the order of their numbers.
  void append_positions(std::vector<Vec3f>& positions) const;

  /// Appends the layer that is seen at each.
  void append_exposed(std::vector<std::uint16_t>& exposed) const;

 private:
  struct Part {
    std::vector<Vec3f> positions;
    std::vector<std::uint16_t> exposed;
    std::uint32_t first = 0;
  };
  struct Scratch;

  void find_solid(const OpenGas* gas);
  void place(std::size_t n, Part& part, Scratch& scratch);
  void find_creases(const Leaf& leaf, LeafVertices& vertices, Scratch& scratch) const;
  bool is_next_to_cover(Node node) const;
  std::optional<std::array<float, 2>> corner_of_face(Node node, int normal) const;
  bool is_beside_sheets(Node node, int normal) const;
  static std::uint32_t number(LeafVertices& vertices, std::uint32_t first);
  void place_on_edges(const Leaf& leaf, const LeafVertices& vertices, Scratch& scratch,
                      Vec3f* positions) const;
  void append_seen(const Leaf& leaf, const LeafVertices& vertices,
                   std::vector<std::uint16_t>& exposed) const;
  std::uint16_t seen_on_face(Node node, int normal) const;

  const Band& band_;
  const Band* above_;
  const Layers* layers_;
  bool several_;
  std::vector<LeafMask> solid_;
  std::unique_ptr<LeafVertices[]> leaves_;
  std::vector<Part> parts_;
  std::uint32_t count_ = 0;
};

}  // namespace scarp
