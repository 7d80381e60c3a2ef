#include "client/vehicle/other_atlases.h"

#include <algorithm>
#include <system_error>

#include "client/vehicle/atlas_folder.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

// Calls back with each file and its bytes until that says no. False then. `error`: there may be
// more.
template <typename OnFile>
bool EachFile(const fs::path& folder, std::error_code& error, const OnFile& on_file) {
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code unreadable;
    const std::uint64_t bytes = entry->file_size(unreadable);
    if (!unreadable && !on_file(entry->path(), bytes)) return false;
  }
  return true;
}

}  // namespace

OtherAtlases::OtherAtlases(const fs::path& root, const fs::path& open) {
  for (const fs::path& folder : AtlasFolders(root)) {
    if (folder == open) continue;
    Other& other = others_.emplace_back(Other{folder, 0});
    std::error_code ignored;  // it counts as much as was found
    EachFile(folder, ignored, [&](const fs::path&, std::uint64_t bytes) {
      other.bytes += bytes;
      return true;
    });
    bytes_ += other.bytes;
  }
}

void OtherAtlases::Remove(std::uint64_t bytes) {
  std::uint64_t gone = 0;
  for (auto oldest = others_.begin(); gone < bytes && oldest != others_.end();) {
    // The file that says when it was opened last goes last, so that what is left goes first again.
    std::error_code error;
    const auto remove = [&](const fs::path& file, std::uint64_t size) {
      if (file.filename() == kAtlasFileName) return true;
      if (gone >= bytes) return false;
      std::error_code ignored;  // it is not counted any more: others go in its place
      fs::remove(file, ignored);
      gone += size;
      oldest->bytes -= std::min(oldest->bytes, size);
      bytes_ -= std::min(bytes_, size);
      return true;
    };
    if (!EachFile(oldest->folder, error, remove)) return;
    if (error) {  // it is looked into the next time
      ++oldest;
      continue;
    }
    std::error_code ignored;
    fs::remove(oldest->folder / kAtlasFileName, ignored);
    fs::remove(oldest->folder, ignored);
    gone += oldest->bytes;
    bytes_ -= std::min(bytes_, oldest->bytes);
    oldest = others_.erase(oldest);
  }
}

}  // namespace atlas
