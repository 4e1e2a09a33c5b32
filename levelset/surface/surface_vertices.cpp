#include "levelset/surface/surface_vertices.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "levelset/grid/exposure.h"
#include "levelset/surface/cell_cases.h"

namespace scarp {

namespace {

/// Vertices keep this distance, in spacings, from the nodes at the ends of their edge: then no
/// triangle has zero area.
constexpr float smallest_part = 1e-3F;

SCARP_VECTOR_KERNEL void find_solid_nodes(const float* phi, LeafMask& solid) {
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t word = 0;
    for (int j = 0; j < leaf_edge; ++j) {
      const float* row = phi + leaf_offset(i, j, 0);
      std::uint32_t bits = 0;
      for (int k = 0; k < leaf_edge; ++k) {
        bits += row[k] < 0 ? 1U << k : 0U;
      }
      word |= std::uint64_t{bits} << (leaf_edge * j);
    }
    solid[i] = word;
  }
}

float phi_at(const Band& band, Node node) { return band.node(node[0], node[1], node[2]); }

/// Calls visit(node, axis) for each edge of a grid face that the surface cuts.
template <class Visit>
void for_each_cut_side(const Band& band, Node node, int normal, const Visit& visit) {
  const std::array<int, 2> axes{(normal + 1) % 3, (normal + 2) % 3};
  for (int n = 0; n < 2; ++n) {
    for (int side = 0; side < 2; ++side) {
      Node from = node;
      from[axes[1 - n]] += side;
      Node to = from;
      ++to[axes[n]];
      if ((phi_at(band, from) < 0) != (phi_at(band, to) < 0)) visit(from, axes[n]);
    }
  }
}

/// Leaves those of the faces normal to an axis whose mixed second difference of phi is large.
SCARP_VECTOR_KERNEL void keep_twisted(const Block& block, int normal, LeafMask& faces) {
  const std::ptrdiff_t b = axis_strides[(normal + 1) % 3];
  const std::ptrdiff_t c = axis_strides[(normal + 2) % 3];
  for (int i = 0; i < leaf_edge; ++i) {
    std::uint64_t word = 0;
    for (int j = 0; j < leaf_edge; ++j) {
      if ((faces[i] >> (leaf_edge * j) & 0xff) == 0) continue;
      const float* row = block.row(i, j);
      std::uint32_t bits = 0;
      for (int k = 0; k < leaf_edge; ++k) {
        const float* phi = row + k;
        bits += std::abs((phi[0] - phi[b]) - (phi[c] - phi[b + c])) >= least_twist ? 1U << k : 0U;
      }
      word |= std::uint64_t{bits} << (leaf_edge * j);
    }
    faces[i] &= word;
  }
}

/// The nodes across the upper edges of a leaf, which gather leaves out and faces on its upper sides
/// need.
void gather_upper_edges(const Band& band, const CellLeaves& leaves, Block& block) {
  const auto phi = [&](int upper) {
    const int leaf = leaves.leaf[upper];
    return leaf >= 0 ? band.leaves()[static_cast<std::size_t>(leaf)].phi : missing_values(leaf);
  };
  const float* xy = phi(3);
  const float* xz = phi(5);
  const float* yz = phi(6);
  const auto [i, j] = leaves.nodes;
  for (int n = 0; n < leaf_edge; ++n) {
    if (i == leaf_edge && j == leaf_edge) block.row(leaf_edge, leaf_edge)[n] = xy[n];
    if (i == leaf_edge) block.row(leaf_edge, n)[leaf_edge] = xz[leaf_offset(0, n, 0)];
    if (j == leaf_edge) block.row(n, leaf_edge)[leaf_edge] = yz[leaf_offset(n, 0, 0)];
  }
}

/// The coordinate along its edge of every vertex. start is that of the edge's first node, from the
/// middle of the domain. Units: start and parts in spacings.
SCARP_VECTOR_KERNEL void find_positions(const float* start, const float* parts, int count,
                                        double spacing, float* along) {
  for (int n = 0; n < count; ++n) {
    const float part = std::min(std::max(parts[n], smallest_part), 1 - smallest_part);
    along[n] =
        static_cast<float>((static_cast<double>(start[n]) + static_cast<double>(part)) * spacing);
  }
}

}  // namespace

/// What is needed for one leaf at a time.
struct SurfaceVertices::Scratch {
  struct EdgeVertex {
    std::uint16_t number;  ///< counted from the leaf's first vertex
    std::uint8_t axis;
    std::uint8_t i;
    std::uint8_t bit;
  };
  struct FaceVertex {
    int kind;
    int i;
    int bit;
    Vec3f position;
  };

  Block block;
  EdgeSamples samples;
  std::array<EdgeVertex, EdgeSamples::most> edges;
  std::array<float, EdgeSamples::most> start;
  std::array<float, EdgeSamples::most> parts;
  std::array<float, EdgeSamples::most> along;
  std::vector<FaceVertex> faces;
};

SurfaceVertices::SurfaceVertices(const Band& band, const OpenGas* gas, const Layers* layers,
                                 const Band* above)
    : band_(band),
      above_(above),
      layers_(layers),
      several_(layers != nullptr && layers->stack.size() > 1),
      solid_(band.leaves().size()),
      leaves_(std::make_unique_for_overwrite<LeafVertices[]>(band.leaves().size())),
      parts_((band.leaves().size() + leaves_per_part - 1) / leaves_per_part) {
  find_solid(gas);
  parallel_for(solid_.size(), leaves_per_part, [&](std::size_t begin, std::size_t end) {
    const auto scratch = std::make_unique_for_overwrite<Scratch>();
    for (std::size_t n = begin; n < end; ++n) {
      place(n, parts_[n / leaves_per_part], *scratch);
    }
  });
  for (Part& part : parts_) {
    part.first = count_;
    count_ += static_cast<std::uint32_t>(part.positions.size());
  }
}

void SurfaceVertices::find_solid(const OpenGas* gas) {
  parallel_for(solid_.size(), leaves_per_part, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (gas == nullptr) {
        find_solid_nodes(band_.leaves()[n].phi, solid_[n]);
        continue;
      }
      // Closed gas counts as solid: none of it is next to open gas along an axis, so that the
      // surface of the open gas stays what it is.
      for (int i = 0; i < leaf_edge; ++i) {
        solid_[n][i] = ~gas->open[n * leaf_edge + static_cast<std::size_t>(i)];
      }
    }
  });
}

void SurfaceVertices::place(std::size_t n, Part& part, Scratch& scratch) {
  const CellLeaves around(band_, n);
  const CellWords words(around, solid_);
  LeafVertices& vertices = leaves_[n];
  std::uint64_t any = 0;
  for (int i = 0; i < leaf_edge; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      vertices.at[axis][i] = words.cut_edges(axis, i);
      vertices.at[3 + axis][i] = words.cut_faces(axis, i);
      any |= vertices.at[axis][i] | vertices.at[3 + axis][i];
    }
  }
  vertices.any = any != 0;
  vertices.has_faces = false;
  if (!vertices.any) return;

  gather<Block::halo>(
      band_, n, [&](std::size_t m) -> const float* { return band_.leaves()[m].phi; },
      scratch.block);
  gather_upper_edges(band_, around, scratch.block);
  const Leaf& leaf = band_.leaves()[n];
  find_creases(leaf, vertices, scratch);
  const std::size_t before = part.positions.size();
  part.positions.resize(before + number(vertices, static_cast<std::uint32_t>(before)));
  place_on_edges(leaf, vertices, scratch, part.positions.data() + before);
  for (const auto& [kind, i, bit, position] : scratch.faces) {
    part.positions[vertices.number(kind, i, bit)] = position;
  }
  if (several_) append_seen(leaf, vertices, part.exposed);
}

/// Leaves of the cut faces those that hold a vertex.
void SurfaceVertices::find_creases(const Leaf& leaf, LeafVertices& vertices,
                                   Scratch& scratch) const {
  const Frame& frame = band_.frame();
  scratch.faces.clear();
  for (int normal = 0; normal < 3; ++normal) {
    LeafMask& faces = vertices.at[3 + normal];
    if (above_ == nullptr) keep_twisted(scratch.block, normal, faces);
    for (int i = 0; i < leaf_edge; ++i) {
      for_each_bit(faces[i], [&](int bit) {
        const Node node = node_at(leaf, 64 * i + bit);
        const auto corner = corner_of_face(node, normal);
        if (!corner) {
          faces[i] &= ~(std::uint64_t{1} << bit);
          return;
        }
        Vec3f r(frame.node_position(node));
        for (int n = 0; n < 2; ++n) {
          const int axis = (normal + 1 + n) % 3;
          r[axis] = static_cast<float>(
              frame.node_position(axis, node[axis] + static_cast<double>((*corner)[n])));
        }
        scratch.faces.push_back({3 + normal, i, bit, r});
      });
    }
  }
  vertices.has_faces = !scratch.faces.empty();
}

const Band& SurfaceVertices::band_of_edge(Node node, int axis) const {
  if (above_ == nullptr) return band_;
  Node gas = node;
  Node solid = node;
  ++(phi_at(band_, node) < 0 ? gas : solid)[axis];
  const bool is_open = phi_at(band_, gas) <= phi_at(*above_, gas) + same_phi;
  return is_open && is_next_to_cover(solid) ? *above_ : band_;
}

/// Whether something that covers the layer is next to a node of it.
bool SurfaceVertices::is_next_to_cover(Node node) const {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      Node other = node;
      other[axis] += step;
      if (phi_at(*above_, other) < 0 && !(phi_at(band_, other) < 0)) return true;
    }
  }
  return false;
}

std::optional<std::array<float, 2>> SurfaceVertices::corner_of_face(Node node, int normal) const {
  if (is_beside_sheets(node, normal)) return std::nullopt;
  if (above_ == nullptr) return face_corner(band_, node, normal);
  const Band* of_face = nullptr;
  bool is_one = true;
  for_each_cut_side(band_, node, normal, [&](Node from, int axis) {
    const Band* of_edge = &band_of_edge(from, axis);
    is_one = is_one && (of_face == nullptr || of_face == of_edge);
    of_face = of_edge;
  });
  if (is_one) return face_corner(*of_face, node, normal);
  return face_corner(band_, node, normal,
                     [&](Node from, int axis) -> const Band& { return band_of_edge(from, axis); });
}

/// Whether several sheets pass through a cell at a face. Those between its edges alone do not
/// cross; one that reaches out to a crease may cross the next.
bool SurfaceVertices::is_beside_sheets(Node node, int normal) const {
  for (int cell = 0; cell < 2; ++cell) {
    int solid = 0;
    for (int c = 0; c < 8; ++c) {
      Node at{node[0] + (c & 1), node[1] + (c >> 1 & 1), node[2] + (c >> 2)};
      at[normal] -= cell;
      solid |= (band_.node(at[0], at[1], at[2]) < 0 ? 1 : 0) << c;
    }
    if (cell_cases()[static_cast<std::size_t>(solid)].loop_count > 1) return true;
  }
  return false;
}

/// Numbers the vertices of a leaf from `first` and tells how many there are.
std::uint32_t SurfaceVertices::number(LeafVertices& vertices, std::uint32_t first) {
  std::uint32_t next = first;
  for (int i = 0; i < leaf_edge; ++i) {
    vertices.first[i] = next;
    for (int kind = 0; kind < vertices.kinds_used(); ++kind) {
      next += static_cast<std::uint32_t>(std::popcount(vertices.at[kind][i]));
    }
  }
  return next - first;
}

/// positions are those of the leaf's vertices.
void SurfaceVertices::place_on_edges(const Leaf& leaf, const LeafVertices& vertices,
                                     Scratch& scratch, Vec3f* positions) const {
  const Frame& frame = band_.frame();
  // In spacings from where coordinates are 0: halves, which floats hold exactly.
  std::array<std::array<float, leaf_edge>, 3> index{};
  std::array<std::array<float, leaf_edge>, 3> coordinate{};
  for (int axis = 0; axis < 3; ++axis) {
    for (int n = 0; n < leaf_edge; ++n) {
      const int node = leaf.origin[axis] + n;
      index[axis][n] = static_cast<float>(node - frame.middle(axis));
      coordinate[axis][n] = static_cast<float>(frame.node_position(axis, node));
    }
  }
  int count = 0;
  std::uint16_t number = 0;
  for (int i = 0; i < leaf_edge; ++i) {
    for_each_bit(vertices.nodes(i), [&](int bit) {
      const std::array<int, 3> local{i, bit >> 3, bit & 7};
      const float* phi = scratch.block.row(i, bit >> 3) + (bit & 7);
      for (int kind = 0; kind < vertices.kinds_used(); ++kind) {
        if ((vertices.at[kind][i] >> bit & 1) == 0) continue;
        if (kind < 3) {
          scratch.samples.set(count, phi, axis_strides[kind]);
          scratch.start[count] = index[kind][local[kind]];
          scratch.edges[count++] = {number, static_cast<std::uint8_t>(kind),
                                    static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(bit)};
        }
        ++number;
      }
    });
  }
  cut_parts(scratch.samples, count, scratch.parts.data());
  for (int n = 0; above_ != nullptr && n < count; ++n) {
    const auto& edge = scratch.edges[n];
    const Node node = node_at(leaf, 64 * edge.i + edge.bit);
    const Band& band = band_of_edge(node, edge.axis);
    if (&band != &band_) scratch.parts[n] = cut_part(band, node, edge.axis);
  }
  find_positions(scratch.start.data(), scratch.parts.data(), count, frame.spacing,
                 scratch.along.data());
  for (int n = 0; n < count; ++n) {
    const auto [vertex, axis, i, bit] = scratch.edges[n];
    Vec3f& r = positions[vertex];
    r = {coordinate[0][i], coordinate[1][bit >> 3], coordinate[2][bit & 7]};
    r[axis] = scratch.along[n];
  }
}

/// The layers that are seen at the vertices of a leaf, in the order of their numbers.
void SurfaceVertices::append_seen(const Leaf& leaf, const LeafVertices& vertices,
                                  std::vector<std::uint16_t>& exposed) const {
  for (int i = 0; i < leaf_edge; ++i) {
    for_each_bit(vertices.nodes(i), [&](int bit) {
      const Node node = node_at(leaf, 64 * i + bit);
      for (int kind = 0; kind < vertices.kinds_used(); ++kind) {
        if ((vertices.at[kind][i] >> bit & 1) != 0) {
          exposed.push_back(kind < 3 ? exposed_layer(*layers_, node, kind)
                                     : seen_on_face(node, kind - 3));
        }
      }
    });
  }
}

/// The lower of what is seen at the two cuts of a face.
std::uint16_t SurfaceVertices::seen_on_face(Node node, int normal) const {
  std::uint16_t exposed = std::numeric_limits<std::uint16_t>::max();
  for_each_cut_side(band_, node, normal, [&](Node from, int axis) {
    exposed = std::min(exposed, exposed_layer(*layers_, from, axis));
  });
  return exposed;
}

void SurfaceVertices::append_positions(std::vector<Vec3f>& positions) const {
  for (const Part& part : parts_) {
    positions.insert(positions.end(), part.positions.begin(), part.positions.end());
  }
}

void SurfaceVertices::append_exposed(std::vector<std::uint16_t>& exposed) const {
  exposed.reserve(exposed.size() + count_);
  for (const Part& part : parts_) {
    exposed.insert(exposed.end(), part.exposed.begin(), part.exposed.end());
  }
}

}  // namespace scarp
