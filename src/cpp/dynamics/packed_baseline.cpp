#define HOVI_LANES 2
#include "packed_expand.hpp"

namespace hovi {

extern const PackedKernel packed_baseline{lanes, workspace_size, expand};

}  // namespace hovi
