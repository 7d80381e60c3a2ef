// The surveys of tiles on disk: of those that memory has no room for, and for the time after a
// restart, when nothing is in memory. One file a tile, bounded by bytes, least recently used first
// out. Disposable: any of them may be damaged or gone at any time, which costs time only.
// Thread-safe.
//
// A file is believed if this very build wrote it, and if the atlas went on from the state that it
// was in then: not if another one, or an older copy, was put in its place (AtlasStart).
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/geometry/map_profile.h"
#include "server/service/fusion/kept_surveys.h"
#include "server/service/fusion/survey_file.h"
#include "server/service/log_sink.h"
#include "server/store/store_types.h"

namespace atlas {

struct SurveyFilesOptions {
  std::filesystem::path directory;  // made if there is none; empty: nothing is kept
  std::size_t max_bytes = std::size_t{4} << 30;
  std::uintmax_t min_free_bytes = std::uintmax_t{1} << 30;  // others need the disk more
};

class SurveyFiles {
 public:
  // Of the atlas with these starts, the last of which is now. Removes the files in the directory
  // that cannot be believed; all of them, and keeps none, where there is no start.
  SurveyFiles(const SurveyFilesOptions& options,
              const MapProfile& profile,
              std::vector<AtlasStart> starts,
              LogSink log);
  SurveyFiles(const SurveyFiles&) = delete;
  SurveyFiles& operator=(const SurveyFiles&) = delete;

  // Packed; none if there are none to be believed. The file stays: it can be gone on from again.
  std::optional<KeptSurveys> Read(const TileId& id);
  // False: they are on disk already, or the disk has no room. An error is logged, and nothing is
  // tried for a minute then.
  bool Write(KeptSurveys& kept);

  bool is_on() const { return is_on_; }
  std::size_t bytes() const;

 private:
  struct Entry {
    std::uint64_t key = 0;
    std::size_t bytes = 0;
  };

  void FindFiles();
  bool IsOfThisAtlas(const SurveyFileHeader& header) const;
  std::filesystem::path PathOf(std::uint64_t key) const;
  bool HasRoom();
  void Insert(const Entry& entry);
  void Remove(std::uint64_t key);
  void Report(const std::string& what);

  SurveyFilesOptions options_;
  MapProfile profile_;
  std::vector<AtlasStart> starts_;
  LogSink log_;
  bool is_on_ = false;
  mutable std::mutex mutex_;  // of what follows
  std::list<Entry> by_age_;   // most recently used first
  std::unordered_map<std::uint64_t, std::list<Entry>::iterator> by_key_;
  std::size_t bytes_ = 0;
  std::uint64_t writes_ = 0;
  std::chrono::steady_clock::time_point not_before_;  // a write failed
};

}  // namespace atlas
