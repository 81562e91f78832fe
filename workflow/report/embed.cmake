# Writes OUTPUT (a C++ file) with the report's page as one string: cmake -DSOURCE=.. -DOUTPUT=.. -P embed.cmake
# @RESULTS@ stays in the page: the program puts the campaign's JSON there.
file(READ ${SOURCE}/report.html page)
foreach(part UPLOT_CSS:vendor/uPlot.min.css REPORT_CSS:report.css UPLOT_JS:vendor/uPlot.iife.min.js
             CHARTS_JS:charts.js REPORT_JS:report.js)
  string(REPLACE ":" ";" part ${part})
  list(GET part 0 name)
  list(GET part 1 file)
  file(READ ${SOURCE}/${file} text)
  string(REPLACE "@${name}@" "${text}" page "${page}")
endforeach()
file(WRITE ${OUTPUT}.tmp "// Generated from workflow/report by embed.cmake.
namespace hemowalk::workflow {
extern const char* const report_page;
const char* const report_page = R\"hemowalk(${page})hemowalk\";
}  // namespace hemowalk::workflow
")
file(RENAME ${OUTPUT}.tmp ${OUTPUT})
