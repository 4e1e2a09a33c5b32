// A public header: installed as scarp/levelset/grid/layers.h.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "core/material.h"
#include "levelset/grid/level_set.h"

namespace scarp {

/// One material and the union of itself with everything below it.
struct Layer {
  MaterialId material = 0;
  LevelSet phi;
};

/// The materials of a wafer in wrapping order: layer k is the union of materials 0..k, the last
/// one is the exposed surface.
///
/// phi never grows from a layer to the next; where two are equal, the upper material is absent.
struct Layers {
  Frame frame;
  std::vector<Layer> stack;

  const LevelSet& top() const { return stack.back().phi; }
  LevelSet& top() { return stack.back().phi; }

  Layers copy() const;
};

/// Lets what is deposited from now on be of the given material: a copy of the top, unless the top
/// is of that material already.
void add_layer(Layers& layers, MaterialId material);

/// Takes away from a solid what is gas for another one.
void cut(LevelSet& solid, const LevelSet& by);

/// Cuts every layer by the top one: what is gas for the top is gas for all.
void cut_lower_layers(Layers& layers);

/// False when layer n is nowhere thicker than a thousandth of a spacing, where its surface cuts the
/// grid: its material is absent.
bool adds_material(const Layers& layers, std::size_t n);

/// Whether any layer of a material is there.
bool has_material(const Layers& layers, MaterialId material);

/// Drops the layers that add no material to the one below them.
void remove_empty_layers(Layers& layers);

/// Drops of the layers that were etched those of which no more than a residue is left: it is
/// nowhere thicker than 0.05 spacings and covers no more than 0.05 of the surface. What remained
/// counts as the material below it from then on.
///
/// Shape: is_etched one per layer. Returns the volume of residues. Units: nm^3.
double remove_residues(Layers& layers, const std::vector<bool>& is_etched);

/// Over all layers with their materials.
std::uint64_t hash(const Layers& layers);

}  // namespace scarp
