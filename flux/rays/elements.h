#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/disjoint_sets.h"
#include "core/tri_mesh.h"
#include "core/vec3.h"
#include "flux/rays/problem.h"
#include "flux/rays/ray_scene.h"

namespace scarp {

inline Vec3d middle_of(const std::array<Vec3d, 3>& corners) {
  return (corners[0] + corners[1] + corners[2]) / 3.0;
}

/// In spacings: of pieces of facets.
inline constexpr double longest_piece_edge = 3;

/// In spacings: of cells in which pieces are joined at most, down walls and on floors; along walls
/// cells are twice as long.
inline constexpr float widest_cell = 4;

/// The surface of a scene in elements, the unknowns of the exchange: large facets of a simplified
/// mesh span places with quite different flux, and small ones, such as marching cubes give, hardly
/// differ from their neighbours.
///
/// A facet is cut through the middle of its longest edge until all edges are short enough: that
/// gives the pieces. An element is a piece, or several neighbours that are joined.
///
/// Units: as in the scene, grid spacings.
class Elements {
 public:
  struct Piece {
    std::array<Vec3d, 3> corners;
    Vec3d normal;
    double area;
    std::uint32_t facet;
  };

  /// Each piece is an element, numbered along the facets.
  /// of_section: they lie one after another along a cross-section, so they are few.
  Elements(const RayScene& scene, double longest_edge, bool of_section = false);

  /// Joins pieces by the edges of their facets if they have middles in the same cell, the
  /// same main direction and material, and normals within 25 degrees across an edge. Cells are as
  /// wide as given for a piece's facet, twice as wide along walls, down which flux changes faster;
  /// half of it where the surface turns by more than about 20 degrees in one. Pieces with an edge
  /// longer than the cell stay alone. A mesh of marching cubes and its simplified one so have about
  /// as many elements. Once.
  ///
  /// Shape: one width per facet, in spacings, each a power of two times the others.
  void join(const TriMesh& mesh, std::span<const float> widths);
  /// With the same width for all.
  void join(const TriMesh& mesh, double width);

  /// Makes an element of each ring (see FluxOptions::rings). Of facets that are not cut.
  void join_rings(std::span<const std::uint32_t> rings);
  bool are_rings() const { return are_rings_; }
  /// Of the cells in which the pieces of a facet were joined; 0 if they were not.
  float cell_width(std::size_t facet) const { return widths_.empty() ? 0 : widths_[facet]; }
  bool are_of_section() const { return are_of_section_; }

  std::size_t count() const { return area_.size(); }
  double area(std::size_t element) const { return area_[element]; }
  /// Numbers of pieces, one after the other.
  class Pieces {
   public:
    struct Iterator {
      std::uint32_t piece;
      std::uint32_t operator*() const { return piece; }
      Iterator& operator++() {
        ++piece;
        return *this;
      }
      bool operator==(const Iterator&) const = default;
    };

    Pieces(std::uint32_t first, std::uint32_t end) : first_(first), end_(end) {}

    Iterator begin() const { return {first_}; }
    Iterator end() const { return {end_}; }
    std::uint32_t front() const { return first_; }
    std::uint32_t operator[](std::size_t k) const { return first_ + static_cast<std::uint32_t>(k); }
    std::size_t size() const { return end_ - first_; }

   private:
    std::uint32_t first_;
    std::uint32_t end_;
  };
  Pieces pieces_of(std::size_t element) const {
    return {first_of_element_[element], first_of_element_[element + 1]};
  }
  /// For each of these, the area of those before it.
  std::span<const double> areas_below(std::size_t element) const {
    return std::span(below_).subspan(first_of_element_[element], pieces_of(element).size());
  }
  const RayScene& scene() const { return *scene_; }
  std::size_t piece_count() const { return pieces_.size(); }
  Vec3d middle(std::size_t element) const { return middle_[element]; }
  /// The mean by area of its normals.
  Vec3d normal(std::size_t element) const { return normal_[element]; }
  /// The mean by area of what each of its facets has.
  template <class OfFacet>
  double mean(std::size_t element, const OfFacet& of_facet) const;

  std::span<const std::uint32_t> pieces_of_facet(std::size_t facet) const {
    return std::span(of_facet_).subspan(first_of_facet_[facet],
                                        first_of_facet_[facet + 1] - first_of_facet_[facet]);
  }
  /// The part of a piece in its facet.
  double share_of_facet(std::size_t piece) const {
    return pieces_[piece].area / scene_->area(pieces_[piece].facet);
  }
  const Piece& piece(std::size_t number) const { return pieces_[number]; }
  /// Asks for the pieces of an element from memory.
  void prefetch(std::size_t element) const {
    constexpr std::size_t line = 64;
    const auto* const begin = reinterpret_cast<const char*>(&pieces_[first_of_element_[element]]);
    for (std::size_t k = 0; k < pieces_of(element).size() * sizeof(Piece); k += line)
      __builtin_prefetch(begin + k);
  }
  std::uint32_t element_of(std::size_t piece) const { return element_of_[piece]; }

  /// The mean by area of what each element of a facet has.
  template <class OfElement>
  double mean_on_facet(std::size_t facet, const OfElement& of_element) const;

  /// The piece of a facet in which a point of it lies; points on a cut go to either side.
  std::uint32_t piece_at(std::uint32_t facet, Vec3d r) const;

 private:
  // A cut from a corner to the middle of the opposite edge, or a piece that is not cut.
  struct Node {
    int corner = -1;          // -1: a piece
    std::uint32_t next = 0;   // the piece, or the node of the half that keeps corner + 1
    std::uint32_t other = 0;  // the node of the half that keeps corner + 2
  };

  std::uint32_t cut(std::uint32_t facet, const std::array<Vec3d, 3>& corners, double area,
                    double longest_edge, int depth);
  std::vector<std::uint32_t> join_in_cells(const TriMesh& mesh, std::span<const std::uint32_t> some,
                                           double width, DisjointSets& joined,
                                           bool leave_turning) const;
  bool turns(std::span<const std::uint32_t> pieces) const;
  void join_neighbours(const TriMesh& mesh, std::span<const std::uint32_t> pieces,
                       DisjointSets& joined) const;
  void join_with(std::span<const std::uint32_t> lowest);
  void put_together();

  std::vector<Piece> pieces_;  // those of an element together
  std::vector<std::uint32_t> first_of_facet_;
  std::vector<std::uint32_t> of_facet_;  // pieces by facet
  std::vector<std::uint32_t> root_;      // per facet: its node
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> element_of_;  // per piece
  std::vector<double> below_;              // per piece: area of those before it in its element
  std::vector<std::uint32_t> first_of_element_;
  std::vector<double> area_;
  std::vector<Vec3d> middle_;
  std::vector<Vec3d> normal_;
  std::vector<float> widths_;  // per facet: of cells
  bool are_rings_ = false;
  bool are_of_section_;
  const RayScene* scene_;
};

/// Elements as rays are sent from them; widths: of the cells in which pieces are joined, but in two
/// dimensions and where there are rings.
///
/// Shape: as of Elements::join; none if pieces stay alone.
Elements elements_of(const FluxProblem& problem, std::span<const float> widths);

template <class OfFacet>
double Elements::mean(std::size_t element, const OfFacet& of_facet) const {
  const auto pieces = pieces_of(element);
  if (pieces.size() == 1) return of_facet(pieces_[pieces.front()].facet);
  double sum = 0;
  for (const std::uint32_t p : pieces) sum += pieces_[p].area * of_facet(pieces_[p].facet);
  return sum / area_[element];
}

template <class OfElement>
double Elements::mean_on_facet(std::size_t facet, const OfElement& of_element) const {
  const auto pieces = pieces_of_facet(facet);
  if (pieces.size() == 1) return of_element(element_of_[pieces.front()]);
  double sum = 0;
  for (const std::uint32_t p : pieces) sum += pieces_[p].area * of_element(element_of_[p]);
  return sum / scene_->area(facet);
}

}  // namespace scarp
