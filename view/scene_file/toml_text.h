// Changes in the text of a TOML file that leave every other byte, comments among them, as it is.
//
//   TomlText text(core::ReadFile(path), path.string());
//   for (const toml::table* lamp : text.Tables("luminaire")) text.Set(*lamp, "scale", "2", "position");
//   core::WriteFileAtomically(path, text.Text());
#pragma once

#include <toml++/toml.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace luxfield::view {

class TomlText {
 public:
  // Throws InputError, naming `file`, for what is no TOML.
  TomlText(std::string text, const std::string& file);

  const toml::table& root() const { return root_; }
  // Those of [[key]], in the file's order.
  std::vector<const toml::table*> Tables(std::string_view key) const;

  // Writes `value` in the place of the key's; where the key is absent, on a line of its own below that
  // of `after`, which the table has.
  void Set(const toml::table& table, std::string_view key, const std::string& value,
           std::string_view after);
  // Leaves out a key with its line, if it is there.
  void Drop(const toml::table& table, std::string_view key);
  // Leaves out [[table]] with all that stands in it; comments above the next table stay.
  void DropTable(const toml::table& table);
  // Adds lines at the end of the file.
  void Append(const std::string& lines) { appended_ += lines; }

  // With all changes, each of which was told once.
  std::string Text() const;

 private:
  // `length` bytes from `at` become `text`.
  struct Edit {
    std::size_t at = 0, length = 0;
    std::string text;
  };
  std::size_t ByteAt(toml::source_position place) const;
  std::size_t LineBegin(std::size_t at) const;
  std::size_t LineEnd(std::size_t at) const;  // behind its line feed

  std::string text_;
  toml::table root_;
  std::vector<Edit> edits_;
  std::string appended_;
};

// As TOML writes them: the shortest number that is read again as the same, a quoted text.
std::string TomlNumber(double value);
std::string TomlString(const std::string& text);

}  // namespace luxfield::view
