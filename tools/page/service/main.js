// The scripts of the page in one (tools/page/bundle.cmake).
{{modules service/service.js}}