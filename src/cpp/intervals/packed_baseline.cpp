#define HOVI_LANES 2
#include "packed_band.hpp"
#include "packed_contraction.hpp"

namespace hovi {

extern const Doors packed_baseline{workspace, contract, factor, solve};

}  // namespace hovi
