#pragma once

#include <span>
#include <vector>

namespace scarp {

/// Which of many differences chance does not explain, however they depend on each other.
///
/// Each comes with the chance that it is as large if nothing differs. Where nothing differs at all,
/// any of them is wrongly among the answer with the wanted chance; where some differ, any of the
/// others likewise. So a difference that is alone has to be as unlikely as the chance by the count;
/// where many differ together, less is asked of each.
///
/// Shape:  an entry per chance.
/// Source: D. J. Wilson, Proc. Natl. Acad. Sci. 116, 1195 (2019): harmonic mean of the chances, by
///         closed testing.
std::vector<bool> beyond_chance(std::span<const double> chances, double wanted);

}  // namespace scarp
