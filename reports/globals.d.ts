// What the pages' scripts find beside their modules: Chart.js, put in before them.
declare const Chart: any;
