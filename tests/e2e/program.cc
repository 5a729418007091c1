#include "program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

namespace luxfield::e2e {

Outcome RunProgram(std::vector<std::string> words, const std::filesystem::path& folder) {
  const auto out_path = folder / ".stdout", err_path = folder / ".stderr";
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    const int out = open(out_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int err = open(err_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (chdir(folder.c_str()) != 0) _exit(126);
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  waitpid(child, &status, 0);
  Outcome outcome;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.out = ReadText(out_path);
  outcome.err = ReadText(err_path);
  std::filesystem::remove(out_path);
  std::filesystem::remove(err_path);
  return outcome;
}

Outcome RunLuxfield(const std::vector<std::string>& arguments,
                    const std::filesystem::path& folder) {
  std::vector<std::string> words{BuiltProgram("luxfield").string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return RunProgram(std::move(words), folder);
}

std::filesystem::path FreshFolder(const std::string& name) {
  const auto folder = std::filesystem::path(testing::TempDir()) /
                      ("luxfield_e2e_" + name + "_" + std::to_string(getpid()));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

std::filesystem::path BuiltProgram(const std::string& name) {
  return std::filesystem::path(LUXFIELD_BINARY_DIR) / name;
}

std::filesystem::path SourceFile(const std::string& relative) {
  return std::filesystem::path(LUXFIELD_SOURCE_DIR) / relative;
}

void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string ReadText(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace luxfield::e2e
