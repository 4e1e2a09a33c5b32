#pragma once

#include <functional>
#include <span>
#include <vector>

#include "flux/rays/problem.h"

namespace scarp {

class KeptHits;

struct Settle {
  /// Changes sticking and emission that problems refer to, to what the arrivals on facets lead to
  /// (one array per problem); false, and no change, when they fit. Of nothing when empty.
  std::function<bool(std::span<const std::vector<float>> arrivals)> update{};
  /// The part of an error of the arrivals that every facet passes on (one array per problem), with
  /// the sticking that it leads to; an empty array where that is 1 - sticking, as all are when this
  /// is empty.
  std::function<std::vector<std::vector<float>>(std::span<const std::vector<float>> arrivals)>
      passed_on{};
  double tolerance = 1e-7;  ///< of the arrivals, relative, root mean square
};

/// Asks every facet what arrives: rays from the facets to the source, and an exchange of what is
/// re-emitted between facets.
///
/// With F the flux on a facet, E its direct part, K the part of its view that each facet fills, s
/// the sticking and G what facets emit of their own, F = E + K ((1 - s) F + G). Rays leave each
/// facet by Lambert's law from places spread over it; those that reach the sky estimate E, the
/// others K, and both serve all species at once. Where hardly any sky is seen every fourth ray is
/// aimed at it: these are the long flights along what is deep, on which the flux there depends.
/// Elements join facets and pieces of facets in cells of four spacings, eight along walls, smaller
/// ones where the surface turns (Elements). What an element re-emits is linear on it (Radiosity),
/// and so is what arrives, which follows the normals of its facets as well. What the size of
/// elements leaves is estimated and part of every error; if it exceeds a third of the target, the
/// cells that make most of it are halved. Where facets emit, cells are one spacing wide.
///
/// Each element sends two independent scrambled Sobol sets, so elements are independent of each
/// other and half the difference of an element's two sets is a fair sample of the error of its
/// equation. Its square is averaged over elements nearby, as a multiple of what parts of their
/// sets make usual (UsualErrors). The error of F takes in the errors of all equations: draws of
/// them, with random signs, go through the exchange and give draws of the error of F.
///
/// The first round tells how much the rays of each part of the surface vary; the next rounds send
/// as many from each as leads to the target with the fewest.
///
/// Power cosine sources with n != 1 are also looked for by rays along the source's lobe; the two
/// kinds are combined by the balance heuristic. Facets are not joined then, nor in two dimensions.
///
/// With settle the exchange is solved on the rays that are there, without errors, until the
/// sticking fits: on those of the first round, which the error of the next rounds is judged with,
/// and on those that reach the target so, or are the last. An error of what arrives changes the
/// sticking, too, and goes on by what settle says; what is emitted is taken as held.
///
/// With hits, rays that are remembered there are not sent again, and those that are sent are
/// remembered. Changes no bit.
///
/// Shape:  all problems share scene, patches and options; one field per problem.
/// Throws: InputError if 4 rays per element, 8 where facets are joined or little sky is seen,
///         exceed options.memory_limit.
/// Cost:   1/4 to 1/2 us per ray on one core, twice that with n != 1, and about half as much again
///         for the solves; 40 bytes per ray and 800 per element. Rounds that miss the target cost a
///         quarter of their solves.
/// Source: Goral et al. 1984 (radiosity), Veach and Guibas 1995 (balance heuristic), Owen 1997
///         (scrambled nets), Wu 1986 (errors by random signs).
std::vector<FluxField> gather(std::span<const FluxProblem> problems, const Settle& settle = {},
                              KeptHits* hits = nullptr);

}  // namespace scarp
