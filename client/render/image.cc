#include "client/render/image.h"

#include <cerrno>
#include <cstdio>

#include <png.h>

#include "core/base/disk_error.h"

namespace atlas {
namespace {

static_assert(sizeof(Rgb) == 3);

// errno of the first call that failed, 0 if all went well.
int WriteTo(const Image& image, const std::filesystem::path& path) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return errno;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = image.width;
  png.height = image.height;
  png.format = PNG_FORMAT_RGB;
  errno = 0;
  int error = 0;
  if (png_image_write_to_stdio(&png, file, 0, image.pixels.data(), 0, nullptr) == 0) {
    error = errno != 0 ? errno : EIO;
  }
  if (std::fclose(file) != 0 && error == 0) error = errno;
  return error;
}

}  // namespace

Status WritePng(const Image& image, const std::filesystem::path& path) {
  std::filesystem::path partial = path;
  partial += ".partial";
  std::error_code error;
  int failed = WriteTo(image, partial);
  if (failed == 0) {
    std::filesystem::rename(partial, path, error);
    failed = error.value();
  }
  if (failed == 0) return {};
  std::filesystem::remove(partial, error);
  return DiskError("cannot write", path, failed);
}

}  // namespace atlas
