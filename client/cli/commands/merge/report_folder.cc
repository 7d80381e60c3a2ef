#include "client/cli/commands/merge/report_folder.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <system_error>
#include <vector>

#include "client/cli/commands/merge/serve_log.h"
#include "client/cli/files/pose_file.h"
#include "client/cli/files/whole_file.h"
#include "client/cli/output/json_text.h"

namespace atlas {
namespace {

// What the files of one report have in common.
std::string StemOf(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  return name.substr(0, name.find('.'));
}

// merge-20261127T031251123Z-...: nothing that somebody else put there.
bool IsReport(const std::string& stem) {
  constexpr std::string_view kForm = "merge-ddddddddTdddddddddZ-";
  return stem.size() >= kForm.size() &&
         std::equal(kForm.begin(), kForm.end(), stem.begin(), [](char form, char c) {
           return form == 'd' ? c >= '0' && c <= '9' : c == form;
         });
}

std::filesystem::path WithEnding(std::filesystem::path stem, const char* ending) {
  stem += ending;
  return stem;
}

// 20261127T031251123Z: without what is awkward in a file's name.
std::string NameOfNow() {
  std::string name = NowText();
  std::erase_if(name, [](char c) { return c == '-' || c == ':' || c == '.'; });
  return name;
}

}  // namespace

Result<ReportFolder> ReportFolder::Open(const std::filesystem::path& folder, std::size_t kept) {
  if (Status status = MakeDirectory(folder); !status.ok()) return Error(std::move(status));
  if (Status status = CheckPlace(folder / "merge"); !status.ok()) return Error(std::move(status));
  ReportFolder reports(folder, kept);
  reports.RemoveOldest();
  return reports;
}

Result<std::filesystem::path> ReportFolder::Write(const std::string& fate,
                                                  const MergeRun& run,
                                                  const boost::json::object& json,
                                                  bool with_corrections) {
  const std::filesystem::path stem = folder_ / ("merge-" + NameOfNow() + "-" + fate);
  Status status = WriteFiles(stem, run, json, with_corrections);
  RemoveOldest();
  if (!status.ok()) return Error(std::move(status));
  return WithEnding(stem, ".json");
}

Status ReportFolder::WriteFiles(const std::filesystem::path& stem,
                                const MergeRun& run,
                                const boost::json::object& json,
                                bool with_corrections) const {
  // Whoever finds the JSON finds the others.
  ATLAS_RETURN_IF_ERROR(WritePng(DrawMerge(run.Picture()), WithEnding(stem, ".png")));
  if (with_corrections) {
    ATLAS_RETURN_IF_ERROR(
        WriteTextFile(WithEnding(stem, ".poses"), PoseFileText(run.Corrections())));
  }
  return WriteTextFile(WithEnding(stem, ".json"), JsonText(json) + "\n");
}

void ReportFolder::RemoveOldest() const {
  std::error_code error;
  std::set<std::string> stems;
  std::vector<std::filesystem::path> files;
  std::filesystem::directory_iterator entry(folder_, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string stem = StemOf(entry->path());
    if (!IsReport(stem)) continue;
    stems.insert(stem);
    files.push_back(entry->path());
  }
  if (stems.size() <= kept_) return;
  const std::string& oldest_kept = *std::prev(stems.end(), static_cast<std::ptrdiff_t>(kept_));
  for (const std::filesystem::path& file : files) {
    if (StemOf(file) < oldest_kept) std::filesystem::remove(file, error);
  }
}

}  // namespace atlas
