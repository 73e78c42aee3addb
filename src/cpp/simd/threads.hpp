// Work on contiguous chunks of points, shared out among threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <system_error>
#include <thread>
#include <vector>

namespace hovi {

// As many threads as are worth it, at most `asked`. work: approximate time of all of it, in [ns].
//
// Starting and joining a thread takes 20 to 90 us, so each gets more work than that.
inline std::size_t useful_threads(std::size_t asked, double work) {
  static const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());  // 6 us
  const auto worthwhile = static_cast<std::size_t>(work / 150e3);
  return std::max<std::size_t>(1, std::min({asked, cores, worthwhile}));
}

// run(0), ..., run(chunks - 1), each on a thread of its own.
template <typename Run>
void share_out(std::size_t chunks, const Run& run) {
  std::vector<std::thread> others;
  others.reserve(chunks);
  try {
    while (others.size() + 1 < chunks) others.emplace_back(run, others.size() + 1);
  } catch (const std::system_error&) {  // a limit on threads: this one does the rest
  }
  run(0);
  for (std::size_t chunk = others.size() + 1; chunk < chunks; ++chunk) run(chunk);
  for (auto& other : others) other.join();
}

}  // namespace hovi
