// Only in the copy of the tree that tests/mutants makes, in every test program: which mutants each
// test reaches and what it costs, a line each in the file LUXFIELD_MUTANT_TESTS.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double Processor_s() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime})
      sum += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  }
  return sum;
}

class NoteReached : public testing::EmptyTestEventListener {
  const std::string reached_ = std::getenv("LUXFIELD_MUTANT_REACHED");
  const std::string tests_ = std::getenv("LUXFIELD_MUTANT_TESTS");
  std::string of_suite_;
  double processor_s_ = 0;
  Clock::time_point begin_;

  std::string Read() const {
    std::ifstream file(reached_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // In place: it is mapped by this process and its children.
  void Clear() const {
    const std::string zeros(Read().size(), '\0');
    std::fstream(reached_, std::ios::binary | std::ios::in | std::ios::out) << zeros;
  }

  void OnTestSuiteStart(const testing::TestSuite&) override {
    Clear();
    of_suite_.clear();
  }
  void OnTestStart(const testing::TestInfo&) override {
    if (of_suite_.empty()) of_suite_ = Read();  // what the suite's set-up reached
    Clear();
    processor_s_ = Processor_s();
    begin_ = Clock::now();
  }
  void OnTestEnd(const testing::TestInfo& test) override {
    const std::string reached = Read();
    std::ofstream file(tests_, std::ios::app);
    file << test.test_suite_name() << '.' << test.name() << '\t' << test.result()->Passed() << '\t'
         << Processor_s() - processor_s_ << '\t'
         << std::chrono::duration<double>(Clock::now() - begin_).count() << '\t';
    for (std::size_t n = 0; n < reached.size(); ++n)
      if (reached[n] || of_suite_[n]) file << n << ' ';
    file << '\n';
  }
};

const bool noting = [] {
  if (std::getenv("LUXFIELD_MUTANT_TESTS"))
    testing::UnitTest::GetInstance()->listeners().Append(new NoteReached);
  return true;
}();

}  // namespace
