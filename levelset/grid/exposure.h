#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/grid/layers.h"

namespace scarp {

class Band;

/// A layer whose phi exceeds the top's by less than this, in spacings, is the top there.
inline constexpr float same_phi = 1e-3F;

/// Part of the way from a node with phi = here to its neighbour at which phi is zero.
inline float crossing(float here, float there) { return here / (here - there); }

/// The layer whose material a solid node lies in.
std::size_t layer_at(const Layers& layers, const std::array<int, 3>& node);

/// The layer that is seen where the top's surface cuts the edge from a node to the next one along
/// an axis.
///
/// It is not below the layer that the edge's solid end lies in, and equals the top at one end at
/// least: phi of a layer that lies under a film of thickness d exceeds the top's by d on both sides
/// of the surface, while near an edge of the surface only one end tells.
std::uint16_t exposed_layer(const Layers& layers, std::array<int, 3> node, int axis);

/// The layer that is seen at the nearest cut of the edges of a node next to the surface. phi is
/// that of the top in a Block.
std::uint16_t exposed_layer_next_to(const Layers& layers, std::array<int, 3> node,
                                    const float* phi);

/// For every node of the top's band the layer that is seen at the surface nearest to it.
///
/// Nodes next to the surface look at the nearest cut of their edges, the others ask a neighbour
/// nearer to the surface. Symmetric under mirroring.
/// Shape: 512 per leaf; the topmost layer where no surface is near.
std::vector<std::uint16_t> exposed_layers(const Layers& layers);

/// Which layers are seen, or lie within the given depth (in spacings) below the surface.
std::vector<bool> layers_within(const Layers& layers, float depth);

/// The least thickness of a film on the surface: where the layer that is seen lies on another one
/// whose surface runs along it. A wall through a stack is no film; what is thinner than least
/// counts as that thick, as the edge of a film does where it ends.
///
/// Units: least in spacings, above 0; result in nm, infinite where no film is thinner than the band
///        is wide.
double thinnest_film(const Layers& layers, float least);

/// The point of the surface that is nearest to a node of the top's band, by phi and its gradient.
Vec3d surface_point(const Layers& layers, std::size_t leaf, int node);

/// How far below the surface each layer begins at a point of the surface; the same as the layer
/// above it where that has no thickness (same_phi). Units: nm.
void find_depths(const Layers& layers, Vec3d surface_point, std::vector<float>& depth);

/// How a surface moves that starts in one layer and may cross into lower ones within a time step:
/// its mean speed along the normal.
///
/// Shape: speeds[k] is the speed while layer k is seen, depth[k] how far below the surface layer k
///        begins, for k = 0..exposed. Units: speeds in depth units per time unit of dt.
/// Source: Ertl, thesis (TU Wien), time budget per grid point; here per point of the surface.
float speed_through_layers(const std::vector<float>& speeds, const std::vector<float>& depth,
                           std::size_t exposed, float dt);

}  // namespace scarp
