// The tiles of the atlases that are not open, beside those of the one that is: they share its bytes
// on the disk, and go before any of its own does.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>

namespace atlas {

class OtherAtlases {
 public:
  OtherAtlases() = default;  // there are none
  // Those below `root` but for the folder `open`. Reads names and sizes.
  OtherAtlases(const std::filesystem::path& root, const std::filesystem::path& open);

  std::uint64_t bytes() const { return bytes_; }
  // Removes files until so many bytes are gone, or all are: of the atlas opened longest ago first,
  // and its folder with its last one.
  void Remove(std::uint64_t bytes);

 private:
  struct Other {
    std::filesystem::path folder;
    std::uint64_t bytes = 0;
  };

  std::deque<Other> others_;
  std::uint64_t bytes_ = 0;
};

}  // namespace atlas
