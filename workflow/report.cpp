#include "workflow/report.hpp"

namespace hemowalk::workflow {

extern const char* const report_page;  // generated from report/

std::string render_report(const nlohmann::ordered_json& results) {
  const std::string mark = "@RESULTS@";
  std::string page = report_page;
  std::string json = results.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  // "</script" inside a string would end the script element that holds the data.
  for (std::size_t at = 0; (at = json.find("</", at)) != std::string::npos; at += 3)
    json.replace(at, 2, "<\\/");
  page.replace(page.find(mark), mark.size(), json);
  return page;
}

}  // namespace hemowalk::workflow
