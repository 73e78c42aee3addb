#define HOVI_LANES 2
#include "packed_expansion.hpp"

namespace hovi {

extern const ChartDoors charts_baseline{rates,  local_rates,   workspace,
                                        expand, pull_gradient, push_steps};

}  // namespace hovi
