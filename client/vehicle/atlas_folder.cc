#include "client/vehicle/atlas_folder.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <tuple>

#include "client/vehicle/stored_file.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

// Frozen.
constexpr std::uint32_t kAtlasMagic = 0x41564152;  // "RAVA"
constexpr std::uint8_t kVersion = 1;

constexpr std::size_t kMaxAtlasBytes = 4096;
constexpr std::string_view kHexDigits = "0123456789abcdef";

std::string NameOf(const Bytes& atlas_id) {
  std::string name;
  for (const std::uint8_t byte : atlas_id) {
    name += kHexDigits[byte >> 4U];
    name += kHexDigits[byte & 15U];
  }
  return name;
}

bool IsName(std::string_view name) {
  return name.size() == 2 * kAtlasIdBytes &&
         name.find_first_not_of(kHexDigits) == std::string_view::npos;
}

Bytes Encode(const AtlasKey& atlas) {
  ByteWriter out;
  const Bytes profile = atlas.profile.Encode();
  out.U32(kAtlasMagic);
  out.U8(kVersion);
  out.Raw(atlas.atlas_id);
  out.U32(static_cast<std::uint32_t>(profile.size()));
  out.Raw(profile);
  return WithChecksum(out.Take());
}

std::optional<AtlasKey> Read(const fs::path& folder) {
  const Result<Bytes> file = LoadFile(folder / kAtlasFileName, kMaxAtlasBytes);
  if (!file) return std::nullopt;
  const Result<ByteSpan> content = WithoutChecksum(*file);
  if (!content) return std::nullopt;
  ByteReader in(*content);
  const bool is_ours = in.U32() == kAtlasMagic && in.U8() == kVersion;
  const ByteSpan id = in.Raw(kAtlasIdBytes);
  const Result<MapProfile> profile = MapProfile::Decode(in.Raw(in.U32()));
  if (!is_ours || !in.ok() || in.remaining() != 0 || !profile) return std::nullopt;
  return AtlasKey{Bytes(id.begin(), id.end()), *profile};
}

void Empty(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;  // a tile of another profile does not decode
    fs::remove(entry->path(), ignored);
  }
}

// The earliest time there is where nothing says it.
fs::file_time_type OpenedAt(const fs::path& folder) {
  std::error_code unknown;
  return fs::last_write_time(folder / kAtlasFileName, unknown);
}

// The time of writing of the file says when the folder was opened. It is later than that of all
// others even where the vehicle's clock was set back.
void NoteOpened(const fs::path& root, const fs::path& folder) {
  fs::file_time_type now = fs::file_time_type::clock::now();
  for (const fs::path& other : AtlasFolders(root)) {
    const fs::file_time_type opened = OpenedAt(other);
    if (other != folder && opened >= now) now = opened + std::chrono::milliseconds(1);
  }
  std::error_code ignored;  // a read-only disk: what it says stays as it is
  fs::last_write_time(folder / kAtlasFileName, now, ignored);
}

}  // namespace

Status AtlasKey::Validate() const {
  if (atlas_id.size() == kAtlasIdBytes) return {};
  return {StatusCode::kInvalidArgument, StrCat("tile files: an atlas id of ", atlas_id.size(),
                                               " bytes, expected ", kAtlasIdBytes)};
}

std::vector<fs::path> AtlasFolders(const fs::path& root) {
  // By name among those opened at the same time.
  std::vector<std::tuple<fs::file_time_type, fs::path>> found;
  std::error_code error;
  for (fs::directory_iterator entry(root, error), end; !error && entry != end;
       entry.increment(error)) {
    if (!IsName(entry->path().filename().string())) continue;
    found.emplace_back(OpenedAt(entry->path()), entry->path());
  }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> folders;
  folders.reserve(found.size());
  for (auto& [opened, folder] : found) {
    folders.push_back(std::move(folder));
  }
  return folders;
}

std::vector<AtlasKey> KnownAtlases(const fs::path& root) {
  std::vector<fs::path> folders = AtlasFolders(root);
  std::reverse(folders.begin(), folders.end());
  std::vector<AtlasKey> known;
  for (const fs::path& folder : folders) {
    auto atlas = Read(folder);
    const bool is_it = atlas && folder.filename() == NameOf(atlas->atlas_id);
    if (is_it) known.push_back(*std::move(atlas));
  }
  return known;
}

Result<fs::path> OpenAtlasFolder(const fs::path& root, const AtlasKey& atlas) {
  if (Status status = atlas.Validate(); !status.ok()) return Error(std::move(status));
  const fs::path folder = root / NameOf(atlas.atlas_id);
  if (Status status = MakeFolder(folder); !status.ok()) return Error(std::move(status));
  const auto known = Read(folder);
  if (known != atlas) {
    if (known) Empty(folder);
    Status status = StoreFile(folder / kAtlasFileName, Encode(atlas), Durability::kWhole);
    if (!status.ok()) return Error(std::move(status));
  }
  NoteOpened(root, folder);
  return folder;
}

}  // namespace atlas
