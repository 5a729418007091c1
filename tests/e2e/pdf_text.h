// Text of PDF files, read back by a program that shares no code with ours.
#pragma once

#include <gtest/gtest.h>

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace luxfield::e2e {

inline bool HasPdfReader() { return std::system("pdftotext -v >/dev/null 2>&1") == 0; }

// In the order in which it was drawn, without white space.
inline std::string LettersOf(const std::filesystem::path& pdf) {
  std::string text;
  std::FILE* reader = popen(("pdftotext -raw -enc UTF-8 '" + pdf.string() + "' -").c_str(), "r");
  for (int c = 0; (c = std::fgetc(reader)) != EOF;)
    if (!std::isspace(c)) text += static_cast<char>(c);
  EXPECT_EQ(pclose(reader), 0);
  return text;
}

}  // namespace luxfield::e2e
