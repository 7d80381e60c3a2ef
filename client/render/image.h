// A picture in memory, 8 bits a channel, and its PNG file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/base/status.h"

namespace atlas {

struct Rgb {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;

  friend bool operator==(const Rgb&, const Rgb&) = default;
};

// Row-major, the first row on top.
struct Image {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<Rgb> pixels;

  const Rgb& at(std::uint32_t x, std::uint32_t y) const {
    return pixels[std::size_t{y} * width + x];
  }
  Rgb& at(std::uint32_t x, std::uint32_t y) { return pixels[std::size_t{y} * width + x]; }
};

// Whole or not at all: written beside `path` and renamed. kPermissionDenied, kNotFound (no such
// folder), kConflict (a folder has the name) or kResourceExhausted (disk full).
Status WritePng(const Image& image, const std::filesystem::path& path);

}  // namespace atlas
