// Texture images.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "luxfield/scene/geometry.h"

namespace luxfield::scene {

// PNG, JPEG and what else OpenCV decodes; 16-bit files are reduced to 8 bits. Alpha is dropped
// (255) or kept, and 255 in files that have none. Throws as pictures/decode_picture.h says, and
// InputError naming `name` if the bytes are no image.
enum class Alpha { kDropped, kKept };
Texture DecodeTexture(std::span<const unsigned char> bytes, const std::string& name,
                      Alpha alpha = Alpha::kDropped);
Texture ReadTexture(const std::filesystem::path& path);

enum class TexelEncoding { kSrgb, kLinear };

// Linear values (Rec. 709 for colours) at uv: bilinear between texel centres after decoding,
// repeating. What the G-buffer kernel computes.
std::array<float, 3> SampleTexture(const Texture& texture, std::array<float, 2> uv,
                                   TexelEncoding encoding = TexelEncoding::kSrgb);

}  // namespace luxfield::scene
