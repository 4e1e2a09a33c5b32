#pragma once

#include <span>
#include <vector>

namespace scarp {

/// How likely a difference is as large if nothing differs, and its share in what is asked for.
struct LookedAt {
  double chance = 1;
  double weight = 1;
};

/// Which of many differences chance does not explain, however they depend on each other.
///
/// Where nothing differs at all,
/// any of them is wrongly among the answer with the wanted chance; where some differ, any of the
/// others likewise. So a difference that is alone has to be as unlikely as the chance times its
/// part of all weights; where many differ together, less is asked of each.
///
/// Shape:  an entry per difference.
/// Source: D. J. Wilson, Proc. Natl. Acad. Sci. 116, 1195 (2019): harmonic mean of the chances, by
///         closed testing.
std::vector<bool> beyond_chance(std::span<const LookedAt> all, double wanted);

}  // namespace scarp
