#include "luxfield/core/sha256.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#if defined(__x86_64__)
#include <cpuid.h>
#endif

#include "luxfield/core/error.h"
#include "luxfield/core/file.h"
#include "luxfield/core/sha256_lanes.h"

namespace luxfield::core {
namespace {

using DigestContext = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

DigestContext StartSha256() {
  DigestContext context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  if (!context || EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) != 1)
    throw DeviceError(
        "SHA-256 is not available in this OpenSSL; install libssl with default providers");
  return context;
}

std::string FinishHex(DigestContext context) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned size = 0;
  EVP_DigestFinal_ex(context.get(), digest.data(), &size);
  std::string hex;
  for (unsigned i = 0; i < size; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

std::string OfOne(const Sha256Message& message) {
  auto context = StartSha256();
  EVP_DigestUpdate(context.get(), message.head.data(), message.head.size());
  EVP_DigestUpdate(context.get(), message.body.data(), message.body.size());
  return FinishHex(std::move(context));
}

// A message as the compression function takes it: whole blocks in three places one after the other,
// the last of which holds the body's end and the padding (FIPS 180-4, 5.1.1).
class Lane {
 public:
  void Begin(const Sha256Message& message) {
    const std::size_t rest = message.body.size() % kSha256Block;
    std::copy_n(message.body.end() - static_cast<std::ptrdiff_t>(rest), rest, end_.begin());
    end_[rest] = '\x80';
    const std::size_t padded = (rest + 9 > kSha256Block ? 2 : 1) * kSha256Block;
    std::uint64_t bits = 8 * (std::uint64_t{message.head.size()} + message.body.size());
    for (std::size_t n = 1; n <= 8; ++n, bits >>= 8) end_[padded - n] = static_cast<char>(bits);
    places_ = {message.head, message.body.substr(0, message.body.size() - rest),
               std::string_view(end_.data(), padded)};
    place_ = 0;
    Take(0);
  }

  std::size_t blocks() const {  // in a row; 0: no more
    return place_ < places_.size() ? places_[place_].size() / kSha256Block : 0;
  }
  const unsigned char* data() const {
    return reinterpret_cast<const unsigned char*>(places_[place_].data());
  }
  void Take(std::size_t blocks) {
    places_[place_].remove_prefix(blocks * kSha256Block);
    while (place_ < places_.size() && places_[place_].empty()) ++place_;
  }

 private:
  std::array<std::string_view, 3> places_;
  std::size_t place_ = places_.size();
  std::array<char, 2 * kSha256Block> end_{};
};

std::string HexOfLane(const Sha256LaneStates& states, std::size_t lane) {
  std::string hex;
  for (const auto& word : states.word) hex += fmt::format("{:08x}", word[lane]);
  return hex;
}

// At most kSha256Lanes messages; their hashes go to `hashes`.
void OfLanes(std::span<const Sha256Message> messages, Sha256LanesCompress* compress,
             std::string* hashes) {
  constexpr std::uint32_t kStart[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                       0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};  // 5.3.3
  Sha256LaneStates states;
  for (std::size_t n = 0; n < 8; ++n) std::fill_n(states.word[n], kSha256Lanes, kStart[n]);
  std::array<Lane, kSha256Lanes> lanes;
  for (std::size_t l = 0; l < messages.size(); ++l) lanes[l].Begin(messages[l]);
  for (;;) {
    const Lane* shortest = nullptr;
    for (const Lane& lane : lanes)
      if (lane.blocks() > 0 && (!shortest || lane.blocks() < shortest->blocks())) shortest = &lane;
    if (!shortest) return;
    const std::size_t blocks = shortest->blocks();
    std::array<const unsigned char*, kSha256Lanes> data;
    for (std::size_t l = 0; l < kSha256Lanes; ++l)  // what is at its end takes another's blocks
      data[l] = (lanes[l].blocks() > 0 ? lanes[l] : *shortest).data();
    compress(states, data, blocks);
    for (std::size_t l = 0; l < messages.size(); ++l) {
      if (lanes[l].blocks() == 0) continue;
      lanes[l].Take(blocks);
      if (lanes[l].blocks() == 0) hashes[l] = HexOfLane(states, l);
    }
  }
}

std::vector<Sha256Way> FindWays() {
  std::vector<Sha256Way> ways;
#if defined(__x86_64__)
  constexpr unsigned kShaInstructions = 1u << 29;  // EBX of leaf 7
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  const bool has_sha = __get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx) && (ebx & kShaInstructions);
  if (has_sha) ways.push_back(Sha256Way::kOneByOne);
  if (__builtin_cpu_supports("avx512vl")) ways.push_back(Sha256Way::kAvx512);
  if (__builtin_cpu_supports("avx2")) ways.push_back(Sha256Way::kAvx2);
  if (has_sha) return ways;
#endif
  ways.push_back(Sha256Way::kOneByOne);
  return ways;
}

}  // namespace

const std::vector<Sha256Way>& Sha256Ways() {
  static const std::vector<Sha256Way> ways = FindWays();
  return ways;
}

std::size_t Sha256Together(std::size_t messages) {
  constexpr std::size_t kWorthLanes = 3;
  return messages < kWorthLanes || Sha256Ways().front() == Sha256Way::kOneByOne ? 1 : kSha256Lanes;
}

std::vector<std::string> Sha256OfEach(std::span<const Sha256Message> messages) {
  return Sha256OfEach(
      messages, Sha256Together(messages.size()) == 1 ? Sha256Way::kOneByOne : Sha256Ways().front());
}

std::vector<std::string> Sha256OfEach(std::span<const Sha256Message> messages, Sha256Way way) {
  std::vector<std::string> hashes(messages.size());
  if (way == Sha256Way::kOneByOne) {
    std::transform(messages.begin(), messages.end(), hashes.begin(), OfOne);
    return hashes;
  }
#if defined(__x86_64__)
  Sha256LanesCompress* const compress =
      way == Sha256Way::kAvx512 ? Sha256LanesAvx512 : Sha256LanesAvx2;
  for (std::size_t begin = 0; begin < messages.size(); begin += kSha256Lanes)
    OfLanes(messages.subspan(begin, std::min(kSha256Lanes, messages.size() - begin)), compress,
            &hashes[begin]);
#endif
  return hashes;
}

std::string Sha256(std::string_view bytes) { return OfOne({{}, bytes}); }

std::string Sha256OfFile(const std::filesystem::path& path) {
  auto context = StartSha256();
  ReadInPieces(path, [&](std::string_view piece) {
    EVP_DigestUpdate(context.get(), piece.data(), piece.size());
  });
  return FinishHex(std::move(context));
}

}  // namespace luxfield::core
