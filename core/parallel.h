// The one thread pool (TBB) and its size.
#pragma once

#include <cstddef>
#include <functional>

namespace luxfield::core {

// Limits every parallel loop of the process, 0 = all cores. Call once, before the first loop.
void SetThreads(int threads);
int Threads();

// Calls body(begin, end) over disjoint pieces of [0, count), each at most about `grain` long.
// Exceptions pass to the caller. Which thread runs which piece never changes a result of ours.
void ParallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t begin, std::size_t end)>& body);

}  // namespace luxfield::core
