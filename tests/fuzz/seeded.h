// A sample of fuzzing for the test suite: texts that are damaged at random, repeatably. The same
// targets run under libFuzzer (CMake option LUXFIELD_FUZZ).
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "luxfield/core/random.h"
#include "tests/seed.h"

namespace luxfield::fuzz {

// A target breaks by crashing, or by throwing.
using Target = std::function<void(std::string_view input)>;

inline void Seeded(const Target& target, const std::vector<std::string>& texts, int count = 20000,
                   std::uint64_t seed = TestSeed(20261122)) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  for (const std::string& text : texts) target(text);
  for (int n = 0; n < count; ++n) {
    core::Random random(seed, static_cast<std::uint64_t>(n));
    std::string text = texts[random() % texts.size()];
    for (std::uint32_t damage = 1 + random() % 8; damage > 0; --damage) {
      const std::size_t at = random() % (text.size() + 1);
      switch (random() % 5) {
        case 0:
          text.insert(at, 1, static_cast<char>(random()));
          break;
        case 1:
          text.erase(at, random() % 4);
          break;
        case 2:
          if (at < text.size()) text[at] = static_cast<char>(random());
          break;
        case 3:  // a piece of another text, or of this one again
          text.insert(at, texts[random() % texts.size()].substr(0, random() % 16));
          break;
        default:
          if (at < text.size()) text[at] = "0123456789.,:|<>[]$-+eE \n"[random() % 25];
      }
    }
    ASSERT_NO_THROW(target(text)) << testing::PrintToString(text);
  }
}

}  // namespace luxfield::fuzz
