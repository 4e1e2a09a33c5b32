#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/system/huge_pages.h"
#include "core/tri_mesh.h"

namespace scarp {

/// Who is whose neighbour in a triangle mesh, in flat arrays, with edge collapse and edge flip.
///
/// Half edge 3 f + i runs from corner i of facet f to the next corner, counter-clockwise.
/// The outgoing half edge of a vertex on the boundary is the first one counter-clockwise, so that
/// turning from it meets all the others. A facet that was collapsed is dead.
class HalfEdges {
 public:
  static constexpr std::uint32_t none = 0xffffffffU;  ///< greater than any number

  /// Drops triangles with a repeated corner and repeated triangles. A vertex where several sheets
  /// touch becomes one vertex per sheet: see copies().
  ///
  /// Throws: InputError if an edge has more than two triangles, or two that disagree about which
  ///         side is out; the message names the end points of the first one.
  /// Cost:   O(triangles); 28 bytes per triangle, 8 per vertex.
  explicit HalfEdges(const TriMesh& mesh);

  /// The vertices that were added for touching sheets: vertex (input's vertex count + i) has the
  /// place of vertex copies()[i].
  std::span<const std::uint32_t> copies() const { return copies_; }

  /// Input triangle of each facet.
  std::span<const std::uint32_t> input_triangles() const { return input_triangles_; }

  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(outgoing_.size()); }
  std::uint32_t half_edge_count() const { return static_cast<std::uint32_t>(origin_.size()); }
  std::uint32_t facet_count() const { return half_edge_count() / 3; }

  static std::uint32_t facet(std::uint32_t h) { return h / 3; }
  static std::uint32_t next(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static std::uint32_t previous(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
  std::uint32_t origin(std::uint32_t h) const { return origin_[h]; }
  std::uint32_t target(std::uint32_t h) const { return origin_[next(h)]; }
  std::uint32_t apex(std::uint32_t h) const { return origin_[previous(h)]; }
  /// The half edge of the neighbouring facet, the other way round; none on the boundary.
  std::uint32_t opposite(std::uint32_t h) const { return opposite_[h]; }
  /// none for a vertex without facets.
  std::uint32_t outgoing(std::uint32_t v) const { return outgoing_[v]; }

  bool alive(std::uint32_t f) const { return origin_[std::size_t{3} * f] != none; }
  bool on_boundary(std::uint32_t v) const { return opposite_[outgoing_[v]] == none; }
  /// The one of its two half edges that stands for an edge.
  bool is_edge(std::uint32_t h) const { return h < opposite_[h]; }
  std::uint32_t edge(std::uint32_t h) const {
    return opposite_[h] != none && opposite_[h] < h ? opposite_[h] : h;
  }

  /// Asks for what is known of a half edge, to be used soon.
  void prefetch(std::uint32_t h) const {
    scarp::prefetch(&origin_[h]);
    scarp::prefetch(&opposite_[h]);
  }

  /// Calls visit(h) for every outgoing half edge of v, counter-clockwise; each belongs to one facet
  /// of v. The mesh must not change meanwhile.
  template <class Visit>
  void for_each_outgoing(std::uint32_t v, const Visit& visit) const {
    const std::uint32_t first = outgoing_[v];
    if (first == none) return;
    std::uint32_t h = first;
    do {
      visit(h);
      h = opposite_[previous(h)];
    } while (h != none && h != first);
  }

  /// Calls visit(w) for every neighbour w of v, counter-clockwise.
  template <class Visit>
  void for_each_neighbour(std::uint32_t v, const Visit& visit) const {
    std::uint32_t last = none;
    for_each_outgoing(v, [&](std::uint32_t h) {
      visit(target(h));
      last = h;
    });
    // A boundary vertex has one neighbour that it has no outgoing half edge to.
    if (last != none && opposite_[previous(last)] == none) visit(apex(last));
  }

  /// Whether the mesh stays a manifold with the same topology when h is collapsed.
  bool can_collapse(std::uint32_t h) const;

  /// Merges target(h) into origin(h): one or two facets die. Only if can_collapse(h).
  void collapse(std::uint32_t h);

  /// Whether the two facets of an edge may exchange its end points for their apexes.
  bool can_flip(std::uint32_t h) const;

  /// Turns the edge of h within its two facets. Only if can_flip(h).
  void flip(std::uint32_t h);

 private:
  struct Rows;
  void link(std::uint32_t a, std::uint32_t b);
  void choose_outgoing(std::uint32_t v, std::uint32_t h);
  void close_facet(std::uint32_t h);
  bool drop_repeated(const Rows& rows);
  /// Returns the first half edge that another one runs along the same way; none if there is none.
  std::uint32_t match_opposites(const Rows& rows);
  void split_touching_sheets(const Rows& rows);
  void split_sheets_of(std::uint32_t v, const Rows& rows);

  LargeVector<std::uint32_t> origin_;
  LargeVector<std::uint32_t> opposite_;
  std::vector<std::uint32_t> outgoing_;
  std::vector<std::uint32_t> input_triangles_;
  std::vector<std::uint32_t> copies_;
};

}  // namespace scarp
