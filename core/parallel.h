// The one thread pool (TBB).
#pragma once

#include <cstddef>
#include <functional>

namespace luxfield::core {

// How many threads a parallel loop takes here.
int Threads();

// Calls work() so that it and all that it calls take at most so many threads, 0 for no limit of its own.
void OnThreads(int threads, const std::function<void()>& work);

// Calls body(begin, end) over disjoint pieces of [0, count), each at most about `grain` long, in the
// execution of the caller (execution.h). Exceptions pass to the caller. Which thread runs which piece
// never changes a result of ours.
void ParallelFor(std::size_t count, std::size_t grain,
                 const std::function<void(std::size_t begin, std::size_t end)>& body);

}  // namespace luxfield::core
