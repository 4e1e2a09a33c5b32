#pragma once

namespace scarp {

/// A surface is smooth across an edge if the cosine between the normals of its two facets is
/// greater: 40 degrees.
inline constexpr double smooth_cosine = 0.766;

}  // namespace scarp
