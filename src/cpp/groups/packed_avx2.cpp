#define HOVI_LANES 4
#include "packed_expansion.hpp"

namespace hovi {

extern const ChartDoors charts_avx2{rates,  local_rates,   workspace,
                                    expand, pull_gradient, push_steps};

}  // namespace hovi
