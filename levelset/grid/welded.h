#pragma once

#include "core/tri_mesh.h"

namespace scarp {

/// The mesh with corners at the same place made one vertex, and without triangles that this
/// collapses; materials are carried over.
///
/// Bodies that touch along an edge or a face keep vertices of their own there, so that no edge has
/// more than two triangles: triangles of one body are those that share the edge in the input, else
/// those with solid between them. What cannot be told apart stays as it is.
/// Shape:  vertices in the order of the input, then those that bodies have of their own.
TriMesh welded(const TriMesh& mesh);

/// Whether welding joins triangles that share no vertices, as where each has three of its own.
bool is_unwelded(const TriMesh& mesh);

}  // namespace scarp
