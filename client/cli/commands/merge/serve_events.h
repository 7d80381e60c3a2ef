// What a service that merges sessions tells of itself, as lines of a log and as reports.
#pragma once

#include <optional>
#include <string>

#include <boost/json/object.hpp>

#include "client/cli/commands/merge/report_folder.h"
#include "client/cli/commands/merge/serve_log.h"
#include "client/merge/serve/merge_event.h"
#include "core/base/status.h"

namespace atlas {

// One call at a time. The log outlives it.
class ServeEvents {
 public:
  // Without a folder there are no reports. `daemon` is its address.
  ServeEvents(ServeLog& log, std::string daemon, std::optional<ReportFolder> reports)
      : log_(log), daemon_(std::move(daemon)), reports_(std::move(reports)) {}

  void Note(const MergeEvent& event);

  // kInvalidData names the first session that cannot be merged however many others come: tilted too
  // far, damaged. Ok: there was none.
  const Status& refused() const { return refused_; }

 private:
  void NoteRefused(const MergeEvent& event);
  void NoteMerge(const MergeEvent& event);
  void NoteApplied(const MergeEvent& event);
  void NoteOverLimits(const MergeEvent& event);
  // Adds `report` to the fields where there is one.
  void Report(const std::string& fate,
              const MergeEvent& event,
              bool with_corrections,
              boost::json::object& fields);

  ServeLog& log_;
  std::string daemon_;
  std::optional<ReportFolder> reports_;
  Status refused_;
};

}  // namespace atlas
