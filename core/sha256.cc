#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <memory>

#include "core/error.h"
#include "core/file.h"

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

}  // namespace

std::string Sha256(std::string_view bytes) {
  auto context = StartSha256();
  EVP_DigestUpdate(context.get(), bytes.data(), bytes.size());
  return FinishHex(std::move(context));
}

std::string Sha256OfFile(const std::filesystem::path& path) {
  auto context = StartSha256();
  ReadInPieces(path, [&](std::string_view piece) {
    EVP_DigestUpdate(context.get(), piece.data(), piece.size());
  });
  return FinishHex(std::move(context));
}

}  // namespace luxfield::core
