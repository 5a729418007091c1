#include <fcntl.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>

#include "luxfield/core/descriptor.h"
#include "luxfield/core/exr_chunks.h"
#include "luxfield/core/exr_zip.h"
#include "luxfield/core/parallel.h"

namespace luxfield::core {
namespace {

static_assert(std::endian::native == std::endian::little, "pixels are written as they lie");

constexpr int kRowsPerChunk = 16;                             // of ZIP_COMPRESSION
constexpr std::size_t kBytesInFlight = std::size_t{1} << 24;  // packed before they are written

void Append(std::vector<unsigned char>& bytes, std::int32_t value) {
  const auto* begin = reinterpret_cast<const unsigned char*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

const unsigned char* BytesOf(const ExrPixels& pixels) {
  return std::visit(
      [](const auto& plane) { return reinterpret_cast<const unsigned char*>(plane.data()); },
      pixels);
}

// Pixels of rows as they lie in a file: row by row, the channels in the order of their names.
void Gather(int width, int first, int rows, std::span<const unsigned char* const> planes,
            std::vector<unsigned char>& block) {
  const std::size_t row_bytes = 4 * static_cast<std::size_t>(width);
  block.resize(static_cast<std::size_t>(rows) * planes.size() * row_bytes);
  unsigned char* to = block.data();
  for (int row = first; row < first + rows; ++row)
    for (const unsigned char* plane : planes) {
      std::memcpy(to, plane + static_cast<std::size_t>(row) * row_bytes, row_bytes);
      to += row_bytes;
    }
}

std::size_t ChunksOf(const ExrPartView& part) {
  return (static_cast<std::size_t>(part.height) + kRowsPerChunk - 1) / kRowsPerChunk;
}

}  // namespace

struct ExrZipWriter::Impl {
  std::filesystem::path path;
  Descriptor file;
  bool several = false;
  int part = 0;
  std::uint64_t table_at = 0, end = 0;

  void WriteAt(std::uint64_t at, std::span<const unsigned char> bytes) const {
    while (!bytes.empty()) {
      const ssize_t count =
          ::pwrite(file.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) FailWriting(path, "write");
      bytes = bytes.subspan(static_cast<std::size_t>(count));
      at += static_cast<std::uint64_t>(count);
    }
  }
};

ExrZipWriter::ExrZipWriter(const std::filesystem::path& path,
                           const std::filesystem::path& temporary,
                           std::span<const ExrPartView> parts)
    : impl_(new Impl{path, Descriptor(::open(temporary.c_str(), O_WRONLY | O_CLOEXEC)),
                     parts.size() > 1}) {
  const off_t size = ::lseek(impl_->file.get(), 0, SEEK_END);
  if (size < 0) FailWriting(path, "write");
  std::size_t chunks = 0;
  for (const ExrPartView& part : parts) chunks += ChunksOf(part);
  impl_->end = static_cast<std::uint64_t>(size);
  impl_->table_at = impl_->end - chunks * sizeof(std::uint64_t);
}

ExrZipWriter::~ExrZipWriter() = default;

void ExrZipWriter::Add(const ExrPartView& part, std::span<const ExrPixels> pixels) {
  std::vector<std::size_t> order(pixels.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return part.channels[a].name < part.channels[b].name;
  });
  std::vector<const unsigned char*> planes;
  for (const std::size_t n : order) planes.push_back(BytesOf(pixels[n]));

  const std::size_t chunks = ChunksOf(part),
                    most = 4 * planes.size() * static_cast<std::size_t>(part.width) * kRowsPerChunk,
                    at_once =
                        std::max<std::size_t>(1, kBytesInFlight / std::max<std::size_t>(most, 1));
  std::vector<std::uint64_t> offsets;
  for (std::size_t first = 0; first < chunks; first += at_once) {
    std::vector<std::vector<unsigned char>> packed(std::min(at_once, chunks - first));
    ParallelFor(packed.size(), 4, [&](std::size_t begin, std::size_t end) {
      ExrZipper zipper(most);
      std::vector<unsigned char> block;
      for (std::size_t k = begin; k < end; ++k) {
        const int row = static_cast<int>(first + k) * kRowsPerChunk;
        Gather(part.width, row, std::min(kRowsPerChunk, part.height - row), planes, block);
        const ExrBytes content = zipper.Pack(block);
        if (impl_->several) Append(packed[k], impl_->part);
        Append(packed[k], row);
        Append(packed[k], static_cast<std::int32_t>(content.size()));
        packed[k].insert(packed[k].end(), content.begin(), content.end());
      }
    });
    for (const auto& chunk : packed) {
      offsets.push_back(impl_->end);
      impl_->WriteAt(impl_->end, chunk);
      impl_->end += chunk.size();
    }
  }
  impl_->WriteAt(impl_->table_at, {reinterpret_cast<const unsigned char*>(offsets.data()),
                                   offsets.size() * sizeof(std::uint64_t)});
  impl_->table_at += offsets.size() * sizeof(std::uint64_t);
  ++impl_->part;
}

}  // namespace luxfield::core
