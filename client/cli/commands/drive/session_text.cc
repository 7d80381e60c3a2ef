#include "client/cli/commands/drive/session_text.h"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

void PrintNotes(const UploadedSession& session, std::ostream& err) {
  const SessionSummary& summary = session.summary;
  if (!summary.IsInMap()) {
    err << "note: session " << StrCat(summary.key) << " is " << summary.state << ", not in the map"
        << (summary.reason.empty() ? "" : ": " + summary.reason) << '\n';
  }
  if (session.others > 0) {
    err << "note: session " << StrCat(summary.key) << " has " << session.others
        << " keyframes more than were selected here: of another selection of the same drive, or of "
           "another drive\n";
  }
}

}  // namespace

boost::json::value SessionStatesJson(const LastingUploadReport& upload) {
  if (!upload.sessions_unknown.ok()) return nullptr;
  boost::json::array states;
  for (const UploadedSession& session : upload.sessions) {
    states.push_back(boost::json::object{{"vehicle", session.summary.key.vehicle},
                                         {"session", session.summary.key.session},
                                         {"state", session.summary.state},
                                         {"reason", session.summary.reason},
                                         {"in_map", session.summary.IsInMap()},
                                         {"others", session.others}});
  }
  return states;
}

Status CheckNotQuarantined(const LastingUploadReport& upload) {
  for (const UploadedSession& session : upload.sessions) {
    const SessionSummary& summary = session.summary;
    if (summary.state != "quarantined") continue;
    return {StatusCode::kConflict,
            StrCat("session ", summary.key, " is out of the map: ", summary.reason,
                   "; atlas session release lets it in as it is")};
  }
  return {};
}

void PrintSessionNotes(const LastingUploadReport& upload, std::ostream& err) {
  if (!upload.sessions_unknown.ok()) {
    err << "note: whether the sessions are in the map nobody could be asked: "
        << upload.sessions_unknown.message() << '\n';
  }
  for (const UploadedSession& session : upload.sessions) {
    PrintNotes(session, err);
  }
}

}  // namespace atlas
