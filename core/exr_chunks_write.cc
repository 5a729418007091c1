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

}  // namespace

ExrRowPacker::ExrRowPacker(int width, std::size_t planes)
    : width_(width),
      zipper_(
          std::make_unique<ExrZipper>(4 * planes * static_cast<std::size_t>(width) * kZipRows)) {}

ExrRowPacker::~ExrRowPacker() = default;

std::span<const unsigned char> ExrRowPacker::Pack(std::span<const unsigned char* const> planes,
                                                  int first, int rows) {
  Gather(width_, first, rows, planes, block_);
  return zipper_->Pack(block_);
}

std::vector<const unsigned char*> PlanesByName(const ExrPartView& part,
                                               std::span<const ExrPixels> pixels) {
  std::vector<std::size_t> order(pixels.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return part.channels[a].name < part.channels[b].name;
  });
  std::vector<const unsigned char*> planes;
  for (const std::size_t n : order) planes.push_back(BytesOf(pixels[n]));
  return planes;
}

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
  for (const ExrPartView& part : parts) chunks += ZipChunks(part.height);
  impl_->end = static_cast<std::uint64_t>(size);
  impl_->table_at = impl_->end - chunks * sizeof(std::uint64_t);
}

ExrZipWriter::~ExrZipWriter() = default;

void ExrZipWriter::Add(const ExrPartView& part, std::span<const ExrPixels> pixels) {
  const std::vector<const unsigned char*> planes = PlanesByName(part, pixels);
  const std::size_t chunks = ZipChunks(part.height),
                    most = 4 * planes.size() * static_cast<std::size_t>(part.width) * kZipRows,
                    at_once =
                        std::max<std::size_t>(1, kBytesInFlight / std::max<std::size_t>(most, 1));
  std::vector<std::vector<unsigned char>> packed;
  AddPacked(part, [&](std::size_t chunk) -> std::span<const unsigned char> {
    if (chunk % at_once == 0) {
      packed.resize(std::min(at_once, chunks - chunk));
      ParallelFor(packed.size(), 4, [&](std::size_t begin, std::size_t end) {
        ExrRowPacker packer(part.width, planes.size());
        for (std::size_t k = begin; k < end; ++k) {
          const int row = static_cast<int>(chunk + k) * kZipRows;
          const auto content = packer.Pack(planes, row, std::min(kZipRows, part.height - row));
          packed[k].assign(content.begin(), content.end());
        }
      });
    }
    return packed[chunk % at_once];
  });
}

void ExrZipWriter::AddPacked(
    const ExrPartView& part,
    const std::function<std::span<const unsigned char>(std::size_t chunk)>& content) {
  std::vector<std::uint64_t> offsets;
  std::vector<unsigned char> bytes;
  for (std::size_t chunk = 0; chunk < ZipChunks(part.height); ++chunk) {
    const std::span<const unsigned char> packed = content(chunk);
    bytes.clear();
    if (impl_->several) Append(bytes, impl_->part);
    Append(bytes, static_cast<std::int32_t>(chunk) * kZipRows);
    Append(bytes, static_cast<std::int32_t>(packed.size()));
    bytes.insert(bytes.end(), packed.begin(), packed.end());
    offsets.push_back(impl_->end);
    impl_->WriteAt(impl_->end, bytes);
    impl_->end += bytes.size();
  }
  impl_->WriteAt(impl_->table_at, {reinterpret_cast<const unsigned char*>(offsets.data()),
                                   offsets.size() * sizeof(std::uint64_t)});
  impl_->table_at += offsets.size() * sizeof(std::uint64_t);
  ++impl_->part;
}

}  // namespace luxfield::core
