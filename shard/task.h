// A verb as a job that is cut along one axis.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "luxfield/core/json.h"

namespace luxfield::shard {

// What one shard left: its files in the order of Task::Endings, and what its Run returned.
struct Piece {
  std::vector<std::filesystem::path> files;
  core::Json figures;
};

// The joined pieces are, to the byte, what the verb writes on one machine of the same kind: processors
// with other vector instructions round otherwise.
class Task {
 public:
  virtual ~Task() = default;

  virtual std::string Axis() const = 0;    // "positions", "rows"
  virtual int Length() const = 0;          // of the axis
  virtual int Grain() const { return 1; }  // shards begin at multiples of it

  // The files whose content, with the options, decides what is written; those of large folders by a
  // file that holds the hashes of the others.
  virtual std::vector<std::filesystem::path> Inputs() const = 0;
  // What shards take from the whole of the inputs, an object: found once, by the plan, which adds the
  // inputs' SHA-256 as "inputs_sha256" and keeps it.
  virtual core::Json Whole() const = 0;

  // A piece, of first to last - 1, consists of files of these endings.
  virtual std::vector<std::string> Endings(int first, int last) const = 0;
  // Does first to last - 1 and writes `files`, one of each ending. Throws what the verb throws.
  virtual core::Json Run(const core::Json& whole, int first, int last,
                         std::span<const std::filesystem::path> files) const = 0;
  // Writes the outputs. Pieces are in the order of the axis.
  virtual void Join(const core::Json& whole, std::span<const Piece> pieces) const = 0;
  virtual std::vector<std::filesystem::path> Outputs() const = 0;
};

}  // namespace luxfield::shard
