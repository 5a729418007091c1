#include "luxfield/core/exr_spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/exr_chunks.h"
#include "luxfield/core/exr_zip.h"
#include "luxfield/core/parallel.h"

namespace luxfield::core {
namespace {

static_assert(ExrRowSpool::kRows == kZipRows);

constexpr std::size_t kBytesInFlight = std::size_t{1} << 24;  // packed before they are written

// A file without a name in the folder of `path`.
Descriptor OpenScratch(const std::filesystem::path& path) {
  std::string name =
      (FolderOf(path) / fmt::format(".{}.XXXXXX", path.filename().string())).string();
  Descriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (file.get() < 0) FailWriting(path, "create scratch for");
  ::unlink(name.c_str());
  return file;
}

}  // namespace

struct ExrRowSpool::Impl {
  struct Chunk {
    std::uint64_t at = 0;
    std::uint32_t size = 0;
    bool marked = false;
  };

  std::filesystem::path path;
  std::vector<ExrPartView> parts;
  Descriptor file;
  int rows = 0;                            // that are there
  std::uint64_t end = 0;                   // of the scratch
  std::vector<std::vector<Chunk>> chunks;  // of each part

  std::size_t BytesOf(int part, std::size_t chunk) const {
    const ExrPartView& view = parts[part];
    const int count = std::min(kRows, view.height - static_cast<int>(chunk) * kRows);
    return 4 * view.channels.size() * static_cast<std::size_t>(view.width) *
           static_cast<std::size_t>(count);
  }

  void Append(std::span<const unsigned char> bytes) {
    while (!bytes.empty()) {
      const ssize_t count =
          ::pwrite(file.get(), bytes.data(), bytes.size(), static_cast<off_t>(end));
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) FailWriting(path, "write scratch for");
      bytes = bytes.subspan(static_cast<std::size_t>(count));
      end += static_cast<std::uint64_t>(count);
    }
  }

  void Read(const Chunk& chunk, std::vector<unsigned char>& bytes) const {
    bytes.resize(chunk.size);
    for (std::size_t filled = 0; filled < bytes.size();) {
      const ssize_t count = ::pread(file.get(), bytes.data() + filled, bytes.size() - filled,
                                    static_cast<off_t>(chunk.at + filled));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) FailWriting(path, "read scratch for");
      filled += static_cast<std::size_t>(count);
    }
  }

  // The content of a chunk with its rows mended, packed again into `bytes`.
  void MendChunk(int part, std::size_t chunk, const Mend& mend, ExrZipper& zipper,
                 std::vector<unsigned char>& bytes) const {
    std::vector<unsigned char> block(BytesOf(part, chunk));
    if (bytes.size() == block.size()) {
      block = bytes;
    } else {
      ExrUnzipper unzipper(block.size());
      if (!unzipper.Take(bytes, block.size()))
        throw std::logic_error("a chunk of ours does not unpack");
      unzipper.Copy(0, block);
    }
    const auto width = static_cast<std::size_t>(parts[part].width);
    std::vector<const ExrChannelView*> channels;
    for (const auto& channel : parts[part].channels) channels.push_back(&channel);
    std::sort(channels.begin(), channels.end(),
              [](const auto* a, const auto* b) { return a->name < b->name; });
    std::vector<float> row(width);
    for (std::size_t at = 0; at < block.size();)
      for (const ExrChannelView* channel : channels) {
        if (channel->pixels.index() == 0) {
          std::memcpy(row.data(), block.data() + at, 4 * width);
          mend(part, channel->name, row);
          std::memcpy(block.data() + at, row.data(), 4 * width);
        }
        at += 4 * width;
      }
    const ExrBytes packed = zipper.Pack(block);
    bytes.assign(packed.begin(), packed.end());
  }
};

ExrRowSpool::ExrRowSpool(const std::filesystem::path& path, std::vector<ExrPartView> parts)
    : impl_(new Impl{path, std::move(parts), OpenScratch(path), 0, 0, {}}) {
  impl_->chunks.resize(impl_->parts.size());
}

ExrRowSpool::~ExrRowSpool() = default;
ExrRowSpool::ExrRowSpool(ExrRowSpool&&) noexcept = default;

void ExrRowSpool::Add(int rows, const std::function<std::vector<ExrPixels>(int part)>& pixels,
                      const std::vector<bool>& marked) {
  Impl& spool = *impl_;
  const std::size_t chunks = ZipChunks(rows);
  if (spool.rows % kRows != 0 || rows < 1 || (!marked.empty() && marked.size() != chunks))
    throw std::logic_error("bands of rows that do not follow each other by whole chunks");
  const ExrPartView& first = spool.parts.front();
  const std::size_t band_bytes =
      4 * first.channels.size() * static_cast<std::size_t>(first.width) * rows;
  const std::size_t at_once = std::max<std::size_t>(1, kBytesInFlight / band_bytes);
  for (std::size_t begin = 0; begin < spool.parts.size(); begin += at_once) {
    std::vector<std::vector<unsigned char>> packed(chunks *
                                                   std::min(at_once, spool.parts.size() - begin));
    ParallelFor(packed.size(), 4, [&](std::size_t from, std::size_t to) {
      ExrRowPacker packer(first.width, first.channels.size());
      for (std::size_t k = from; k < to; ++k) {
        const std::size_t part = begin + k / chunks;
        const int row = static_cast<int>(k % chunks) * kRows;
        const auto planes = PlanesByName(spool.parts[part], pixels(static_cast<int>(part)));
        const auto content = packer.Pack(planes, row, std::min(kRows, rows - row));
        packed[k].assign(content.begin(), content.end());
      }
    });
    for (std::size_t k = 0; k < packed.size(); ++k) {
      spool.chunks[begin + k / chunks].push_back({spool.end,
                                                  static_cast<std::uint32_t>(packed[k].size()),
                                                  !marked.empty() && marked[k % chunks]});
      spool.Append(packed[k]);
    }
  }
  spool.rows += rows;
}

void ExrRowSpool::Write(const Mend& mend) {
  const Impl& spool = *impl_;
  if (spool.rows != spool.parts.front().height)
    throw std::logic_error("a file of bands is written before all are there");
  ExrZipper zipper(spool.BytesOf(0, 0));
  std::vector<unsigned char> bytes;
  WriteExrPacked(spool.path, spool.parts, [&](int part, std::size_t chunk) {
    const Impl::Chunk& where = spool.chunks[part][chunk];
    spool.Read(where, bytes);
    if (where.marked && mend) spool.MendChunk(part, chunk, mend, zipper, bytes);
    return std::span<const unsigned char>(bytes);
  });
}

}  // namespace luxfield::core
