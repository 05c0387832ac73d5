'use strict';
drawExtremes(data);
document.body.dataset.rendered = 'true';
