// Runs the built program as a user does.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace luxfield::e2e {

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

// The program words[0] (a path, or a name that $PATH finds) with its arguments, in `folder`. No
// shell is involved, so arguments need no quoting.
Outcome RunProgram(std::vector<std::string> words, const std::filesystem::path& folder);

// build/luxfield with these arguments, in `folder`.
Outcome RunLuxfield(const std::vector<std::string>& arguments, const std::filesystem::path& folder);

// A fresh empty folder for this test.
std::filesystem::path FreshFolder(const std::string& name);

std::filesystem::path BuiltProgram(const std::string& name);    // build/NAME
std::filesystem::path SourceFile(const std::string& relative);  // a file of the repository

void WriteText(const std::filesystem::path& path, const std::string& text);
std::string ReadText(const std::filesystem::path& path);

}  // namespace luxfield::e2e
