import {drawExtremes} from './extremes.js';
import {data} from './page.js';

drawExtremes(data);
document.body.dataset.rendered = 'true';
