#include "tests/server/store/volatile_files.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>

#include <fcntl.h>

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSectorBytes = 512;

Bytes ContentOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void Write(const fs::path& file, const Bytes& content) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(content.data()),
            static_cast<std::streamsize>(content.size()));
  if (!out.flush()) {
    throw std::runtime_error("cannot write " + file.string());
  }
}

bool Coin(std::mt19937& random) {
  return random() % 2 == 0;
}

void Overwrite(std::uint64_t offset, ByteSpan bytes, Bytes& content) {
  content.resize(std::max<std::size_t>(content.size(), offset + bytes.size()));
  std::copy(bytes.begin(), bytes.end(), content.begin() + static_cast<std::ptrdiff_t>(offset));
}

}  // namespace

void VolatileFiles::NoteOpen(const fs::path& file) {
  const std::lock_guard lock(mutex_);
  State& state = files_[file];
  if (state.is_deleted) {
    state = State();  // another one under this name
    return;
  }
  if (!state.durable && state.changes.empty() && fs::exists(file) && fs::file_size(file) > 0) {
    state.durable = ContentOf(file);
  }
}

void VolatileFiles::NoteWrite(const fs::path& file, std::uint64_t offset, ByteSpan bytes) {
  const std::lock_guard lock(mutex_);
  files_[file].changes.push_back({offset, Bytes(bytes.begin(), bytes.end()), std::nullopt});
}

void VolatileFiles::NoteTruncate(const fs::path& file, std::uint64_t size) {
  const std::lock_guard lock(mutex_);
  files_[file].changes.push_back({0, {}, size});
}

void VolatileFiles::NoteSync(const fs::path& file) {
  const std::lock_guard lock(mutex_);
  State& state = files_[file];
  const bool is_new_log = !state.durable && file.filename().string().find('-') != std::string::npos;
  Bytes content = state.durable.value_or(Bytes());
  std::mt19937 unused;
  for (const Change& change : state.changes) {
    Apply(change, Loss::kAll, unused, content);
  }
  state.durable = std::move(content);
  state.changes.clear();
  state.is_deleted = false;
  if (is_new_log) {  // SQLite syncs its folder then
    SettleFolder(file.parent_path());
  }
}

void VolatileFiles::NoteFailedSync(const fs::path& file) {
  const std::lock_guard lock(mutex_);
  files_[file].changes.clear();
}

void VolatileFiles::NoteDelete(const fs::path& file) {
  const std::lock_guard lock(mutex_);
  files_[file].is_deleted = true;
}

void VolatileFiles::NoteRename(const fs::path& from, const fs::path& to) {
  const std::lock_guard lock(mutex_);
  renames_.push_back(
      {from, to, fs::is_regular_file(to) ? std::optional(ContentOf(to)) : std::nullopt});
  files_.erase(to);
  if (auto known = files_.extract(from)) {
    known.key() = to;
    files_.insert(std::move(known));
  }
}

void VolatileFiles::NoteFolderSync(const fs::path& folder) {
  const std::lock_guard lock(mutex_);
  SettleFolder(folder);
}

// Who was deleted does not come back, and names stay.
void VolatileFiles::SettleFolder(const fs::path& folder) {
  std::erase_if(files_, [&](const auto& file) {
    return file.second.is_deleted && file.first.parent_path() == folder;
  });
  std::erase_if(renames_, [&](const Rename& rename) { return rename.to.parent_path() == folder; });
}

void VolatileFiles::Forget() {
  const std::lock_guard lock(mutex_);
  files_.clear();
  renames_.clear();
}

// What of it came to the disk: all of it, but for lost sectors.
void VolatileFiles::Apply(const Change& change, Loss loss, std::mt19937& random, Bytes& content) {
  if (change.size) {
    content.resize(*change.size);
    return;
  }
  if (loss != Loss::kSectors) {
    Overwrite(change.offset, change.bytes, content);
    return;
  }
  std::uint64_t at = change.offset;
  const std::uint64_t end = change.offset + change.bytes.size();
  while (at < end) {
    const std::uint64_t next = std::min(end, (at / kSectorBytes + 1) * kSectorBytes);
    if (Coin(random)) {
      Overwrite(at, ByteSpan(change.bytes).subspan(at - change.offset, next - at), content);
    }
    at = next;
  }
}

void VolatileFiles::UndoRenames(std::size_t kept) {
  for (; renames_.size() > kept; renames_.pop_back()) {
    const Rename& rename = renames_.back();
    ::renameat(AT_FDCWD, rename.to.c_str(), AT_FDCWD, rename.from.c_str());  // if it is there still
    if (rename.replaced) {
      Write(rename.to, *rename.replaced);
    }
  }
}

void VolatileFiles::LosePower(Loss loss, std::uint32_t seed) {
  const std::lock_guard lock(mutex_);
  std::mt19937 random(seed);
  for (const auto& [file, state] : files_) {
    const bool stays_deleted = state.is_deleted && (loss == Loss::kAll || Coin(random));
    Bytes content = state.durable.value_or(Bytes());
    for (const Change& change : state.changes) {
      const bool is_lost = loss == Loss::kAll || (loss == Loss::kSome && Coin(random));
      if (!is_lost) {
        Apply(change, loss, random, content);
      }
    }
    if (stays_deleted || (!state.durable && content.empty())) {
      fs::remove(file);
    } else {
      Write(file, content);
      fs::last_write_time(file, std::chrono::file_clock::from_sys(
                                    std::chrono::sys_seconds()));  // before the system started
    }
  }
  std::size_t kept = 0;
  while (loss != Loss::kAll && kept < renames_.size() && Coin(random)) {
    ++kept;
  }
  UndoRenames(kept);
  files_.clear();
  renames_.clear();
}

}  // namespace atlas
