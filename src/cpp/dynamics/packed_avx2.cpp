#define HOVI_LANES 4
#include "packed_expand.hpp"

namespace hovi {

extern const PackedKernel packed_avx2{lanes, workspace_size, expand};

}  // namespace hovi
