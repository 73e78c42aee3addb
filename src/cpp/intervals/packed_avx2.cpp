#define HOVI_LANES 4
#include "packed_band.hpp"
#include "packed_contraction.hpp"

namespace hovi {

extern const Doors packed_avx2{workspace, contract, factor, solve};

}  // namespace hovi
